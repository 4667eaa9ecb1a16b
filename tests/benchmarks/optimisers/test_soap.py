import pytest
import torch

from benchmarks.optimisers.soap import Soap


def _train(optimiser: type[torch.optim.Optimizer], parameter, loss, steps: int, **settings) -> float:
    stepper = optimiser([parameter], **settings)
    for _ in range(steps):
        stepper.zero_grad()
        loss(parameter).backward()
        stepper.step()
    return loss(parameter).item()


def _turned_quadratic(size: int, spread: float):
    """tr(X^T A X B) with ill-conditioned A and B whose eigenvectors are turned against the axes."""
    generator = torch.Generator().manual_seed(0)
    sides = []
    for _ in range(2):
        basis = torch.linalg.qr(torch.randn(size, size, generator=generator, dtype=torch.float64)).Q
        sides.append(basis * torch.logspace(0, -spread, size, dtype=torch.float64) @ basis.T)
    start = torch.randn(size, size, generator=generator, dtype=torch.float64)
    return start, lambda x: torch.trace(x.T @ sides[0] @ x @ sides[1])


def test_the_turned_basis_beats_adam_on_a_turned_ill_conditioned_quadratic():
    start, loss = _turned_quadratic(12, 2.0)
    results = {
        optimiser: _train(optimiser, start.clone().requires_grad_(), loss, 300, lr=0.03)
        for optimiser in (Soap, torch.optim.Adam)
    }
    assert results[Soap] < 0.1 * results[torch.optim.Adam]


def test_it_does_not_depend_on_the_basis():
    start, loss = _turned_quadratic(6, 1.0)
    turn = torch.linalg.qr(
        torch.randn(6, 6, generator=torch.Generator().manual_seed(5), dtype=torch.float64)
    ).Q
    plain = start.clone().requires_grad_()
    turned = (turn @ start).requires_grad_()
    _train(Soap, plain, loss, 40, lr=0.01)
    _train(Soap, turned, lambda x: loss(turn.T @ x), 40, lr=0.01)
    torch.testing.assert_close(turned.detach(), turn @ plain.detach(), rtol=0, atol=1e-4)  # rounding grows


def test_vectors_are_trained_by_adam():
    start = torch.linspace(0.5, 2, 7, dtype=torch.float64)
    settings = {"lr": 0.01, "betas": (0.9, 0.99), "eps": 1e-8}
    ends = []
    for optimiser in (Soap, torch.optim.Adam):
        parameter = start.clone().requires_grad_()
        _train(optimiser, parameter, lambda x: (x**4).sum(), 20, **settings)
        ends.append(parameter.detach())
    torch.testing.assert_close(*ends)


def test_a_batch_of_matrices_is_trained_as_each_alone():
    start, loss = _turned_quadratic(5, 1.0)
    batch = torch.stack([start, start.T]).requires_grad_()
    _train(Soap, batch, lambda x: loss(x[0]) + loss(x[1]), 15, lr=0.01)
    for k, alone in enumerate((start.clone(), start.T.clone())):
        _train(Soap, alone.requires_grad_(), loss, 15, lr=0.01)
        torch.testing.assert_close(batch[k].detach(), alone.detach())


def test_the_loss_of_the_closure_is_returned():
    parameter = torch.ones(2, 2, requires_grad=True)

    def closure() -> torch.Tensor:
        loss = (parameter**2).sum()
        loss.backward()
        return loss

    assert Soap([parameter]).step(closure).item() == pytest.approx(4)


def test_renewed_bases_come_to_diagonalise_the_averages():
    generator = torch.Generator().manual_seed(0)
    parameter = torch.zeros(4, 4, dtype=torch.float64)
    optimiser = Soap([parameter], frequency=1)
    scales = torch.logspace(0, 2, 4, dtype=torch.float64)[:, None]
    for turned in (scales.flip(0), *[scales] * 200):  # the first basis is far from the later gradients'
        parameter.grad = turned * torch.randn(4, 4, generator=generator, dtype=torch.float64)
        optimiser.step()
    basis, average = optimiser.state[parameter]["bases"][0], optimiser.state[parameter]["sides"][0]
    diagonalised = basis.T @ average @ basis
    off_diagonal = diagonalised - torch.diag(diagonalised.diagonal())
    assert float(off_diagonal.norm()) < 0.05 * float(average.norm())
