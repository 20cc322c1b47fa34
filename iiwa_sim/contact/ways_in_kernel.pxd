# For kernels that meet shapes.
cdef (double, double, double, double) nearest(
    int kind, double a, double b, double c, double x, double y, double z
) noexcept
cdef (double, double, double, double) come_in(
    int kind, double a, double b, double c, double radius, double x, double y, double z,
    double mx, double my, double mz
) noexcept
cdef (double, double, double, double) _through_a_face(
    double a, double b, double c, double x, double y, double z, double mx, double my, double mz,
    double distance, double nx, double ny, double nz
) noexcept
cdef (double, double, double, double) _into_a_cylinder(
    double a, double b, double radius, double x, double y, double z, double mx, double my, double mz,
    double distance, double nx, double ny, double nz
) noexcept
