"""Networks with random hidden weights and an exactly solved output layer: `pinn-std`, `pinn-local`.

Imports `solvers.pinn.threading`, `solvers.assimilation`; nothing of `solvers.pinn.paper`.
"""
