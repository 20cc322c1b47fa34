# For the kernel of gripper and parts.
from iiwa_sim.handling.held_kernel cimport Held

cdef class Pieces:
    cdef public long changes           # how many times a part has been put somewhere
    cdef public set pushed             # the names of those that something else moves in this tick
    cdef public long lying_changes     # how many times a part has come to lie, or has ceased to
    cdef public list _lying            # the names of parts that lie; None until somebody asks for them
    cdef public object _gripper
    cdef public Held _held             # the part between the jaws, or None
    cdef public set _lively            # the names of parts that do not rest
    cdef public str _lost              # the name of a part that the jaws cannot hold until they have opened
    cdef public object _tcp            # where it has been in the last tick, or None where that is not known
    cpdef object step(self, object tcp, object coming=?)
