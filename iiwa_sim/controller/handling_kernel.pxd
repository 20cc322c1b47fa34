# For the kernel of ticks.
from iiwa_sim.contact.load_kernel cimport ExternalLoad
from iiwa_sim.handling.aside_kernel cimport Aside
from iiwa_sim.handling.pieces_kernel cimport Pieces
from iiwa_sim.robot.feeling_kernel cimport Reached

cdef class HandlingTicks:
    cdef public object gripper         # it may be asked for its state, and told to open or close by its outputs only
    cdef public Pieces workpieces      # the parts, or None where there are none
    cdef public Aside _aside           # what pushes these
    cdef public ExternalLoad _load
    cdef public object _io
    cdef public long _changes          # of surfaces that the parts know of
    # Outputs, part in the jaws and opening with which these stay as they are; None where that is not known.
    cdef public object _rest
    cdef object step(self, object joints, Reached contact, object coming)
