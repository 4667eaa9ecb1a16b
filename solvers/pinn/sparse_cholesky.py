"""Sparse symmetric positive definite systems by MUMPS."""

from typing import Any

import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from geometry.arrays import FloatArray
from geometry.errors import UserError


def solve_positive_definite(matrix: csr_matrix, right: FloatArray) -> FloatArray:
    """Solve for several right-hand sides (n, k) with one factorisation.

    Raises:
        UserError: If the factorisation fails.
    """
    index: Any = PETSc.IntType
    stored = PETSc.Mat().createAIJ(
        matrix.shape,
        csr=(matrix.indptr.astype(index), matrix.indices.astype(index), matrix.data),
        comm=PETSc.COMM_SELF,
    )
    stored.setOption(PETSc.Mat.Option.SPD, True)
    ksp = PETSc.KSP().create(PETSc.COMM_SELF)
    ksp.setOperators(stored)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    preconditioner = ksp.getPC()
    preconditioner.setType(PETSc.PC.Type.CHOLESKY)
    preconditioner.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
    ksp.setErrorIfNotConverged(True)
    solution = np.empty_like(right)
    vector, result = stored.createVecs()
    try:
        for column in range(right.shape[1]):
            vector.array[:] = right[:, column]
            ksp.solve(vector, result)
            solution[:, column] = result.array
    except PETSc.Error as error:
        raise UserError("MUMPS cannot factorise the network's output layer; take fewer units") from error
    finally:
        for item in (vector, result, ksp, stored):
            item.destroy()
    return solution
