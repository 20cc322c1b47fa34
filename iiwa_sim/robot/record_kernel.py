"""Named tuples made by kernels, at once: a call of their class makes several tuples on the way."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython

if cython.compiled:
    from cython.cimports.cpython.object import PyTypeObject
    from cython.cimports.cpython.ref import Py_INCREF
    from cython.cimports.cpython.tuple import PyTuple_SET_ITEM
    from cython.cimports.iiwa_sim.robot.record_kernel import PyType_GenericAlloc


@cython.cfunc
def record(kind: Any, values: tuple[Any, ...]) -> object:
    """A named tuple of that class with all its values, none of them left to its default."""
    if not cython.compiled:
        return tuple.__new__(kind, values)
    made: object = PyType_GenericAlloc(cython.cast(cython.pointer(PyTypeObject), kind), len(values))
    n: cython.Py_ssize_t
    for n in range(len(values)):
        each: object = values[n]
        Py_INCREF(each)
        PyTuple_SET_ITEM(made, n, each)
    return made
