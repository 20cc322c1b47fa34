# For the kernel that pushes parts aside.
from iiwa_sim.contact.load_kernel cimport ExternalLoad
from iiwa_sim.handling.held_kernel cimport Held

cdef class ArmWay:
    cdef double look_at_m              # where on the way parts are looked for
    cdef double next_m                 # where on it the first part is looked at
    cdef readonly list watched         # names of parts near the arm
    cdef dict _rows                    # their numbers
    cdef double[::1] _due              # where on the way each is looked at
    cdef object _watch(self, object names)
    cdef void _find_next(self) noexcept
    cdef ExternalLoad _load
    cdef double _tick
    cdef double _stroke
    # In the last tick: joint positions (rad), whether they are known, how far apart the jaws were (m), what
    # they held; and the longest levers of that (m).
    cdef double[::1] _q
    cdef bint _is_known
    cdef double _opening
    cdef object _in_jaws
    cdef long _begun                   # how often something worn had begun to feel parts
    cdef double[::1] _levers
    # No point of the arm, or of what it holds, has gone farther (m) up to when that was found, and since.
    cdef double _way
    cdef double _loose
    cdef double _soon                  # and in a few ticks like the last one
    cdef double _brought               # how far what it holds has gone (m) up to when the way was found
    cdef double[::1] _by               # and its middle, in the base
    # Where the TCP was then, and what it holds in that.
    cdef double[::1] _tcp
    cdef double _in_x
    cdef double _in_z
    cdef double[::1] _now
    cdef bint _turns(self, object joints) except? -1
    cdef object _goes(self, Held held, object tcp, object joints, double opening, bint looks)
    cdef object _find_levers(self, Held held)
