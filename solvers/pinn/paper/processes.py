"""Processes that torchrun started: they share the points of a training and add up their gradients."""

import os
from dataclasses import dataclass

import torch
import torch.distributed


@dataclass(frozen=True)
class Processes:
    """This process among all.

    Attributes:
        rank: Its number; 0 reports and writes.
        count: How many there are.
    """

    rank: int
    count: int

    @classmethod
    def of_environment(cls) -> "Processes":
        """Those of torchrun (RANK, WORLD_SIZE), connected by Gloo, or this one alone."""
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


ONE_PROCESS = Processes(0, 1)
