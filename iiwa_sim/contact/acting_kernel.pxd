# For the kernel of loads, which finds tick by tick what acts.
from iiwa_sim.robot.arm_kernel cimport Tcp

cdef class Acting:
    cdef Tcp _tcp
    cdef object _noise                 # None for none
    cdef object _wrench                # applied from outside, at the TCP
    cdef object _joint_push            # and to each joint
    cdef bint _pushed                  # by one of these two
    cdef bint _joints_pushed
    cdef object _touch                 # wrench of surfaces at the TCP
    cdef object _carried               # of what the controller does not know of
    cdef object _handed                # of parts
    cdef object _handed_push           # and what of that a robot that yields gives way to
    cdef object _handed_torques        # of parts on links (Nm); None for none
    cdef public object bodies          # what tells which parts links touch; None without parts
    cdef object _met                   # of surfaces on tool and jaws
    cdef object _link_torques          # of surfaces on links; None for none
    cdef object _folded                # torques of links on links; None for none
    cdef object _unknown               # moments of what the controller does not know of, in the flange
    cdef object _at_tcp                # the same, in the frame of the TCP
    cdef object _motion              # of the TCP, while there is any of that
    cdef object _carried_at            # joints at which it was evaluated last
    cdef object _links                 # once there has been a surface
    cdef readonly object pushes        # what a robot that yields gives way to, besides surfaces at the TCP
    cdef readonly bint judged          # whether all that acts has been judged by `surely_within` since it was set
    cpdef object tcp(self, object joints)
    cpdef object hand(self, object wrench, object push, object torques)
    cpdef bint surely_within(self, double part_per_n, double least_nm, double most_n, double most_nm) except? -1
    cdef bint _acts(self) noexcept
    cdef object _sum(self)
