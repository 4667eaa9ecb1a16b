"""Several processes started by torchrun, which share a training's points and sum their gradients."""

import os
from dataclasses import dataclass

import torch
import torch.distributed


@dataclass(frozen=True)
class ProcessGroup:
    """This process and the number of all.

    Attributes:
        rank: Its number; 0 reports and writes.
        count: Number of processes.
    """

    rank: int
    count: int

    @classmethod
    def from_environment(cls) -> "ProcessGroup":
        """The processes of torchrun (RANK, WORLD_SIZE), connected by Gloo, or this one alone."""
        count = int(os.environ.get("WORLD_SIZE", "1"))
        if count == 1:
            return ONE_PROCESS
        if not torch.distributed.is_initialized():
            torch.distributed.init_process_group("gloo")
        return cls(torch.distributed.get_rank(), count)

    def sum(self, *tensors: torch.Tensor) -> None:
        """Replace tensors by their sums over all processes."""
        if self.count > 1:
            for tensor in tensors:
                torch.distributed.all_reduce(tensor)


ONE_PROCESS = ProcessGroup(0, 1)
