# Another base with Python 3.11 or newer, or this one by its digest: --build-arg BASE=python:3.13-slim-bookworm@sha256:...
ARG BASE=python:3.13-slim-bookworm

FROM ${BASE} AS build

# A compiler for what is compiled: our kernels, and on ARM Ruckig, of which there are no wheels.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends binutils g++ libgomp1 rdfind \
    && apt-get clean \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin

# With a link, so that no line below has to know which Python it is.
WORKDIR /src
RUN python -m venv /opt/iiwa-sim \
    && ln -s "$(basename /opt/iiwa-sim/lib/python3.*)" /opt/iiwa-sim/lib/python

# The libraries on their own: a change of our code does not fetch them again.
COPY pyproject.toml ./
RUN python -c "import tomllib; p = tomllib.load(open('pyproject.toml', 'rb'))['project']; \
        extras = p['optional-dependencies']; \
        print(*p['dependencies'], *extras['rosbridge'], *extras['http'], sep='\n')" \
        > libraries.txt \
    && /opt/iiwa-sim/bin/pip install --no-cache-dir --requirement libraries.txt

# Headers, static libraries, tests and what of numpy and websockets only their users would load go; a library under three
# names becomes links to one. The .pyc files stay: they halve the start. Pinocchio asks its own folder for GCC's libgomp first:
# with it there the image takes nothing from apt.
WORKDIR /opt/iiwa-sim/lib/python/site-packages
RUN rm -rf include cmeel.prefix/bin cmeel.prefix/share \
        numpy/_pyinstaller numpy/distutils numpy/f2py numpy/fft numpy/ma numpy/polynomial numpy/testing \
        websockets/asyncio websockets/legacy websockets/sync websockets/trio \
    && find . -type d '(' -name include -o -name tests -o -name cmake -o -name pkgconfig ')' -prune -exec rm -rf {} + \
    && find . '(' -name '*.a' -o -name '*.pxd' -o -name '*.pyi' ')' -delete \
    && rdfind -makesymlinks true -makeresultsfile false cmeel.prefix \
    && cp -L /usr/lib/*-linux-gnu/libgomp.so.1 cmeel.prefix/lib

# Libraries that nobody maps go, Assimp's stand-in takes its place, symbols go (but not of what numpy.libs has: strip
# leaves those misaligned), and so do .pyc files of kernels, whose compiled modules are loaded in their place. Isolated (-I),
# the check imports what is installed; otherwise the checkout in /src comes first.
WORKDIR /src
COPY . .
# Git is not in here to tell the version; where nobody does, setuptools-scm takes that of pyproject.toml. Kernels are C: they
# need no tables to unwind, nor pages of their own for code.
ARG VERSION
RUN CFLAGS="-fno-asynchronous-unwind-tables" LDFLAGS="-Wl,-z,noseparate-code" SETUPTOOLS_SCM_PRETEND_VERSION_FOR_IIWA_SIM="${VERSION}" \
        /opt/iiwa-sim/bin/pip install --no-cache-dir --no-deps . \
    && /opt/iiwa-sim/bin/python -I tools/prune_libraries.py \
    && /opt/iiwa-sim/bin/python -I tools/stand_in.py libassimp.so Assimp \
    && find /opt/iiwa-sim -type f '(' -name '*.so' -o -name '*.so.*' ')' -not -path '*/numpy.libs/*' \
        -exec strip --strip-unneeded {} + \
    && /opt/iiwa-sim/bin/python -I tools/prune_libraries.py --check \
    && /opt/iiwa-sim/bin/pip uninstall --yes setuptools pip \
    && rm -f /opt/iiwa-sim/lib/python/site-packages/*.dist-info/RECORD \
    && find /opt/iiwa-sim -name '*_kernel.*.pyc' -delete


# What the live page needs on top, as a tree to be laid over the other: its libraries, of which websockets may be another
# than that of rosbridge, which takes either; and parts of numpy that are left out above.
FROM build AS build-view

WORKDIR /opt/view
RUN python -c "import tomllib; p = tomllib.load(open('/src/pyproject.toml', 'rb'))['project']; \
        print(*p['optional-dependencies']['view'], sep='\n')" > /src/view.txt \
    && python -m venv /opt/pip \
    && /opt/iiwa-sim/bin/python -c "import numpy; print('numpy ==', numpy.__version__)" >> /src/view.txt \
    && /opt/pip/bin/pip install --no-cache-dir --target . --requirement /src/view.txt \
    && numpy="/opt/over$(realpath /opt/iiwa-sim/lib/python)/site-packages/numpy" \
    && mkdir -p "$numpy" \
    && mv numpy/fft numpy/ma numpy/polynomial numpy/testing "$numpy" \
    && rm -rf bin msgspec* numpy numpy-* numpy.libs \
    && mv /opt/view /opt/over/opt \
    && find /opt/over -type d -name tests -prune -exec rm -rf {} + \
    && find /opt/over -type f '(' -name '*.so' -o -name '*.so.*' ')' -not -path '*.libs/*' \
        -exec strip --strip-unneeded {} +


# The environment of the node of ROS 2, where it will be, without what only a compiler would need; numpy is that of the
# robot. Libraries in *.libs have been patched: strip leaves those misaligned.
FROM build AS build-ros2

WORKDIR /opt/ros2
RUN /opt/iiwa-sim/bin/iiwa-sim ros2-env /opt/ros2 \
    && ln -s "$(basename lib/python3.*)" lib/python \
    && bin/python -m pip uninstall --yes numpy setuptools pip \
    && rm -rf include share lib/cmake lib/*.a \
    && ln -s /opt/iiwa-sim/lib/python/site-packages/numpy /opt/iiwa-sim/lib/python/site-packages/numpy.libs \
        lib/python/site-packages \
    && find . '(' -name '*.pyi' -o -name '*.hpp' -o -name '*.h' -o -name '*.c' -o -name '*.cpp' ')' -delete \
    && find . -type f '(' -name '*.so' -o -name '*.so.*' ')' -not -path '*.libs/*' \
        -exec strip --strip-unneeded {} + \
    && rdfind -makesymlinks true -makeresultsfile false lib


FROM ${BASE} AS robot

ARG BASE
ARG VERSION
ARG REVISION
LABEL org.opencontainers.image.title="iiwa-sim" \
      org.opencontainers.image.description="A robot controller in software that speaks the LBR iiwa text protocol" \
      org.opencontainers.image.licenses="MIT" \
      org.opencontainers.image.base.name="${BASE}" \
      org.opencontainers.image.version="${VERSION}" \
      org.opencontainers.image.revision="${REVISION}"

RUN useradd --uid 10001 --no-create-home --no-log-init --shell /usr/sbin/nologin iiwa
COPY --from=build /opt/iiwa-sim /opt/iiwa-sim
# One thread for linear algebra: arrays are small here, and a pool of threads takes its time to start.
ENV PATH=/opt/iiwa-sim/bin:$PATH \
    OPENBLAS_NUM_THREADS=1 \
    IIWA_SIM_HOST=0.0.0.0
# The official images have no .pyc of Python's own library, and who serves later may not write them. What server and
# health check load gets them here.
RUN python -I -c "import iiwa_sim.cli.health, iiwa_sim.cli.serve, iiwa_sim.simulator, \
        iiwa_sim.ros.rosbridge.server, iiwa_sim.backdoor.http"
USER 10001

EXPOSE 30000 54600 9090
HEALTHCHECK --interval=10s --timeout=5s --start-period=10s --start-interval=1s \
    CMD ["iiwa-sim", "health"]
ENTRYPOINT ["iiwa-sim"]


# docker build --target view: with the live page at port 8080, which wants a token: IIWA_SIM_VIEW_TOKEN.
FROM robot AS view

COPY --from=build-view /opt/over /
ENV PYTHONPATH=/opt/view \
    IIWA_SIM_VIEW_HOST=0.0.0.0 \
    IIWA_SIM_VIEW_PORT=8080
EXPOSE 8080


# docker build --target ros: a node of ROS 1, with a master and the tools to try it with. Debian 12 has these packages.
# What they bring for C++ is not unpacked: nodes and tools in Python map none of it. Their logs, and the types that genpy
# makes, go to /dev/shm, which any user may write to, also where the root is read-only.
FROM robot AS ros

USER 0
# hadolint ignore=DL3008
RUN printf 'path-exclude=%s\n' \
        '/usr/lib/*/libicu*' '/usr/lib/*/libboost*' '/usr/lib/*/liblog4cxx*' '/usr/lib/*/libroscpp*' \
        '/usr/share/doc/libicu*' '/usr/share/doc/libboost*' '/usr/share/doc/liblog4cxx*' \
        '/usr/share/locale/*' '/usr/share/man/*' '/usr/share/info/*' > /etc/dpkg/dpkg.cfg.d/python-only \
    && apt-get update \
    && apt-get install --yes --no-install-recommends \
        python3-rosmaster python3-rospy python3-rosservice python3-rostopic python3-sensor-msgs python3-std-srvs \
    && apt-get clean \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin \
    && python -I -c "import sys; sys.path.append('/usr/lib/python3/dist-packages'); import iiwa_sim.ros.ros1.node"
ENV ROS_LOG_DIR=/dev/shm \
    TMPDIR=/dev/shm \
    ROS_PACKAGE_PATH=/opt/iiwa-sim/lib/python/site-packages/iiwa_sim/protocol/rmi
USER 10001
ENTRYPOINT ["iiwa-sim", "--ros"]


# docker build --target ros2: a node of ROS 2 (x86-64). Others are met in the container's network; Fast DDS writes to
# /dev/shm, too.
FROM robot AS ros2

USER 0
COPY --from=build-ros2 /opt/ros2 /opt/ros2
RUN /opt/ros2/bin/python -I -c "import rclpy.action, rclpy.executors, sensor_msgs.msg, std_srvs.srv, tf2_msgs.msg, \
        control_msgs.action, industrial_msgs.msg, robot_movement_interface.msg, robot_movement_interface.srv"
ENV ROS_LOG_DIR=/dev/shm/ros \
    ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET
USER 10001
ENTRYPOINT ["iiwa-sim", "--ros2", "--ros2-python", "/opt/ros2/bin/python"]


# What is built where no target is named.
FROM robot
