"""SOAP: Adam in the slowly turning eigenbasis of Shampoo's preconditioner.

Every matrix of parameters, the last two axes of a tensor with at least two, has the averages L of G G^T and
R of G^T G over its gradients G. Adam's second moments are kept in the basis of their eigenvectors Q_L and
Q_R, where the gradient is Q_L^T G Q_R; the basis is renewed every few steps by one power iteration and a QR
decomposition. Vectors are trained by Adam itself.

Source: N. Vyas, D. Morwani, R. Zhao, M. Kwun, I. Shapira, D. Brandfonbrener, L. Janson, S. Kakade: SOAP:
improving and stabilizing Shampoo using Adam, ICLR 2025 (arXiv:2409.11321), algorithms 3 and 4, with the
first step given to the averages alone and, as there, the first moment kept in the original basis.
"""

from collections.abc import Callable, Iterable
from typing import Any

import torch


class Soap(torch.optim.Optimizer):
    """SOAP for tensors of any shape.

    Args:
        parameters: The trained tensors.
        lr: Learning rate.
        betas: Averaging of the first moment and of the second, which that of L and R shares.
        eps: Added to the root of the second moment.
        frequency: Steps between renewals of the bases.
    """

    def __init__(
        self,
        parameters: Iterable[torch.Tensor],
        lr: float = 3e-3,
        betas: tuple[float, float] = (0.95, 0.95),
        eps: float = 1e-8,
        frequency: int = 10,
    ) -> None:
        super().__init__(parameters, {"lr": lr, "betas": betas, "eps": eps, "frequency": frequency})

    @torch.no_grad()
    def step(self, closure: Callable[[], Any] | None = None) -> Any:
        """One step; the very first only starts the averages."""
        loss = None
        if closure is not None:
            with torch.enable_grad():
                loss = closure()
        for group in self.param_groups:
            for parameter in group["params"]:
                if parameter.grad is not None:
                    _step(parameter, parameter.grad, self.state[parameter], group)
        return loss


def _step(
    parameter: torch.Tensor, gradient: torch.Tensor, state: dict[str, Any], group: dict[str, Any]
) -> None:
    """One step for one tensor."""
    if not state:
        sides = _outer(gradient) if gradient.dim() >= 2 else []
        bases = [torch.linalg.eigh(side).eigenvectors for side in sides]
        zeros = torch.zeros_like(gradient)
        state |= {"steps": 0, "first": zeros, "second": zeros.clone(), "sides": sides, "bases": bases}
        if bases:
            return
    state["steps"] += 1
    rate, second_rate = group["betas"]
    first, second, bases = state["first"], state["second"], state["bases"]
    first.lerp_(gradient, 1 - rate)
    second.lerp_(_turn(gradient, bases) ** 2, 1 - second_rate)
    mean = _turn(first, bases) / (1 - rate ** state["steps"])
    step = mean / ((second / (1 - second_rate ** state["steps"])).sqrt() + group["eps"])
    parameter.sub_(group["lr"] * _turn(step, [basis.mT for basis in bases]))
    if bases:
        for side, product in zip(state["sides"], _outer(gradient), strict=True):
            side.lerp_(product, 1 - second_rate)
        if state["steps"] % group["frequency"] == 0:
            pairs = zip(state["sides"], bases, strict=True)
            state["bases"] = [torch.linalg.qr(side @ basis).Q for side, basis in pairs]


def _outer(gradient: torch.Tensor) -> list[torch.Tensor]:
    return [gradient @ gradient.mT, gradient.mT @ gradient]


def _turn(matrix: torch.Tensor, bases: list[torch.Tensor]) -> torch.Tensor:
    """Q_L^T matrix Q_R; a vector, which has no bases, stays as it is."""
    return bases[0].mT @ matrix @ bases[1] if bases else matrix
