# For kernels that make named tuples.
from cpython.object cimport PyTypeObject

cdef extern from "Python.h":
    object PyType_GenericAlloc(PyTypeObject* kind, Py_ssize_t count)

cdef object record(object kind, tuple values)
