# For the kernel of gripper and parts.
from iiwa_sim.contact.links_beside_kernel cimport LinksBeside
from iiwa_sim.handling.held_kernel cimport Held
from iiwa_sim.handling.taken_along_kernel cimport TakenAlong

cdef class Aside(TakenAlong):
    cdef object _seen                  # the number of changes of parts when they were looked for
    cdef dict _known                   # whether each is near, and until where on the way
    cdef object _solid                 # what is held, as a surface in this tick, once that is asked for
    cdef list _brought_up              # parts that are elsewhere than the arm knew: looked at in the next tick
    cdef bint _calm                    # a tick in which arm and parts stayed as they were has changed nothing
    cdef object _changes               # of the parts, when the last tick ended
    cdef object step(self, object tcp, object joints, double opening)
    cdef object _near_ones(self, Held held, object tcp, object joints, object moving)
    cdef double _gap(self, Py_ssize_t row, LinksBeside links, Held held, object tcp) except? -1.0
    cdef object _held_there(self, Held held, object tcp)
    cdef object _look(self, Held held, object tcp, object joints)
    cdef object _push(self, object near, Held held, object tcp, object joints)
    cdef bint _is_pushed(self, str name, Held held, object tcp, object joints) except? -1
