# For the kernels of a tick, and of what the arm pushes.
from iiwa_sim.contact.acting_kernel cimport Acting
from iiwa_sim.contact.links_kernel cimport Links
from iiwa_sim.contact.tcp_touch_kernel cimport TcpTouch
from iiwa_sim.contact.world_kernel cimport World
from iiwa_sim.robot.feeling_kernel cimport Reached
from iiwa_sim.robot.arm_kernel cimport Tcp

cdef class ExternalLoad(Acting):
    cdef readonly World world          # the surfaces; changes are felt from the next tick on
    cdef readonly long looks_at_itself # the tick in which links could meet each other at the earliest
    cdef readonly object itself        # the links of the arm, as they meet each other
    cdef readonly object levers_m      # no joint's axis is farther from the TCP (m), wherever the robot is; base first
    cdef object _model
    cdef Tcp _coming_tcp               # each remembers one pose
    cdef object _coming_joints         # where it was asked for; None where it is that of this tick
    cdef object _tool                  # what is worn
    cdef object _jaws
    cdef int _surrounded               # the number of changes of the world that the links know of
    cdef int _settled                  # and when a tick left all contacts unchanged
    cdef TcpTouch _at_world            # the TCP
    cdef object _joints                # at the last tick
    cpdef object coming_tcp(self, object joints)
    cpdef Links surround(self, object joints)
    cpdef bint is_idle(self, long tick) except? -1
    cpdef object step(self, object joints, long tick, double tick_s, Reached contact=?, object coming=?)
    cdef object _look_at_itself(self, object joints, long tick, double tick_s)
    cdef object _touch_links(self, object joints, double tick_s)
    cdef object _part_links(self)
    cdef object _put(self, object joints)
