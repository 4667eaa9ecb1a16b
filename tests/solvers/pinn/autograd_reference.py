"""The paper's training written plainly with torch's automatic differentiation, to compare ours with.

Nothing is shared with the package but the mesh, the initial weights and the load's functional: layers are
`torch.nn.Linear`, derivatives along x and y and over the weights are torch's, the law is written out.
"""

import numpy as np
import torch

from pinnray.solvers.problem import Problem, contact_functional


class PlainMlp(torch.nn.Module):
    """One network of the paper, whose first gate takes X directly."""

    def __init__(self, width: int, layers: int) -> None:
        super().__init__()
        self.encoder_a = torch.nn.Linear(2, width)
        self.encoder_b = torch.nn.Linear(2, width)
        self.first = torch.nn.Linear(2, width)
        self.gates = torch.nn.ModuleList(torch.nn.Linear(width, width) for _ in range(layers - 1))
        self.last = torch.nn.Linear(width, 1)

    def forward(self, points: torch.Tensor) -> torch.Tensor:
        a, b = torch.tanh(self.encoder_a(points)), torch.tanh(self.encoder_b(points))
        hidden = torch.tanh(self.first(points))
        hidden = (1 - hidden) * a + hidden * b
        for gate in self.gates:
            z = torch.tanh(gate(hidden))
            hidden = (1 - z) * a + z * b
        return self.last(hidden)[:, 0]


class PlainPinn:
    """Both networks, the loss and Adam."""

    def __init__(self, problem: Problem, solver, dtype: torch.dtype = torch.float64) -> None:
        """Start from the solver's initial weights.

        Args:
            problem: What is solved.
            solver: A `PaperPinnSolver` for its settings.
            dtype: Precision.
        """
        self.problem = problem
        self.factors = {"PDE": 1.0, "BC": solver.bc_weight}
        parameters = solver.network.initial(solver.seed, dtype)
        first, gates, biases, output, output_bias = solver.network.weights(parameters)
        self.networks = []
        for k in range(2):
            network = PlainMlp(solver.width, solver.layers).to(dtype)
            layers = [network.encoder_a, network.encoder_b, network.first, *network.gates, network.last]
            initial = [(layer[:2], layer[2]) for layer in first[k]]
            initial += [(gate[k], bias[k, 0]) for gate, bias in zip(gates, biases, strict=True)]
            initial.append((output[k], output_bias[k]))
            with torch.no_grad():
                for layer, (matrix, bias) in zip(layers, initial, strict=True):
                    layer.weight.copy_(matrix.T)
                    layer.bias.copy_(bias)
            self.networks.append(network)
        trained = [parameter for network in self.networks for parameter in network.parameters()]
        self.adam = torch.optim.Adam(trained, lr=solver.learning_rate)

        def tensor(array) -> torch.Tensor:
            return torch.tensor(np.asarray(array), dtype=dtype)

        self.nodes = tensor(problem.mesh.points)
        base = problem.mesh.points[np.unique(problem.mesh.boundary("base"))]
        y = np.linspace(base[:, 1].min(), base[:, 1].max(), solver.base_points)
        self.base = tensor(np.column_stack([np.full_like(y, base[0, 0]), y]))
        self.contact, self.contact_weights = map(tensor, contact_functional(problem))
        if problem.observations is not None:
            self.factors["ASM"] = solver.asm_weight
            self.markers = tensor(problem.observations.points)
            self.measured = tensor(problem.observations.displacements)

    def loss(self) -> dict[str, torch.Tensor]:
        """The terms, with a graph for differentiating once more."""
        points = self.nodes.requires_grad_()
        du, dv = (
            torch.autograd.grad(network(points).sum(), points, create_graph=True)[0]
            for network in self.networks
        )
        xx, yy, xy = du[:, 0], dv[:, 1], (du[:, 1] + dv[:, 0]) / 2
        young, poisson = self.problem.material.young, self.problem.material.poisson
        factor = young / (1 + poisson)
        if self.problem.material.plane == "strain":
            reduced = poisson / (1 - 2 * poisson)
        else:
            reduced = poisson / (1 - poisson)
        density = factor / 2 * (xx**2 + yy**2 + 2 * xy**2 + reduced * (xx + yy) ** 2)
        base = torch.stack([network(self.base) for network in self.networks])
        boundary = (base**2).sum(dim=0).mean()
        for network, wanted in zip(self.networks, self.problem.load.displacement, strict=True):
            if wanted is not None:
                boundary = boundary + ((network(self.contact) * self.contact_weights).sum() - wanted) ** 2
        terms = {"PDE": density.mean(), "BC": boundary}
        if "ASM" in self.factors:
            moved = torch.stack([network(self.markers) for network in self.networks], dim=1)
            terms["ASM"] = ((moved - self.measured) ** 2).sum(dim=1).mean()
        return terms

    def step(self) -> tuple[float, ...]:
        """One epoch: PDE, BC, with observations ASM, and the total before the step."""
        self.adam.zero_grad()
        terms = self.loss()
        total = sum(self.factors[name] * term for name, term in terms.items())
        total.backward()
        self.adam.step()
        return *(term.item() for term in terms.values()), total.item()
