# Another base with Python 3.11 or newer, or this one by its digest: --build-arg BASE=python:3.13-slim-bookworm@sha256:...
ARG BASE=python:3.13-slim-bookworm

FROM ${BASE} AS build
# hadolint ignore=DL3008
RUN apt-get update && apt-get install --yes --no-install-recommends g++ libgomp1 && rm -rf /var/lib/apt/lists/*
WORKDIR /src
RUN python -m venv /opt/iiwa-sim && ln -s "$(basename /opt/iiwa-sim/lib/python3.*)" /opt/iiwa-sim/lib/python
COPY . .
# Git is not in here to tell the version; without this argument setuptools-scm takes that of pyproject.toml.
ARG VERSION
RUN SETUPTOOLS_SCM_PRETEND_VERSION_FOR_IIWA_SIM="${VERSION}" /opt/iiwa-sim/bin/pip install --no-cache-dir '.[rosbridge]' \
    && find /opt/iiwa-sim -type d '(' -name include -o -name cmake ')' -prune -exec rm -rf {} + \
    && find /opt/iiwa-sim -name '*.a' -delete \
    && cp -L /usr/lib/*-linux-gnu/libgomp.so.1 /opt/iiwa-sim/lib/python/site-packages/cmeel.prefix/lib

FROM build AS build-view
RUN /opt/iiwa-sim/bin/pip install --no-cache-dir 'iiwa-sim[view]'

FROM build AS build-ros2
RUN /opt/iiwa-sim/bin/iiwa-sim ros2-env /opt/ros2

FROM ${BASE} AS robot
ARG VERSION REVISION
LABEL org.opencontainers.image.title="iiwa-sim" org.opencontainers.image.licenses="MIT" \
      org.opencontainers.image.version="${VERSION}" org.opencontainers.image.revision="${REVISION}"
RUN useradd --uid 10001 --no-create-home --no-log-init --shell /usr/sbin/nologin iiwa
COPY --from=build /opt/iiwa-sim /opt/iiwa-sim
# One thread for linear algebra: arrays are small. The import writes .pyc files of Python's own library.
ENV PATH=/opt/iiwa-sim/bin:$PATH OPENBLAS_NUM_THREADS=1 IIWA_SIM_HOST=0.0.0.0
RUN python -I -c "import iiwa_sim.cli.commands, iiwa_sim.client, iiwa_sim.cli.serve, iiwa_sim.simulator, iiwa_sim.backdoor.http"
USER 10001
EXPOSE 30000 54600 9090
HEALTHCHECK --interval=10s --timeout=5s --start-period=10s --start-interval=1s CMD ["iiwa-sim", "health"]
ENTRYPOINT ["iiwa-sim"]

# docker build --target view: with the live page at port 8080, which wants a token: IIWA_SIM_VIEW_TOKEN.
FROM robot AS view
COPY --from=build-view /opt/iiwa-sim /opt/iiwa-sim
ENV IIWA_SIM_VIEW_HOST=0.0.0.0 IIWA_SIM_VIEW_PORT=8080
EXPOSE 8080

# docker build --target ros: a node of ROS 1, with a master and tools. Logs and types go to /dev/shm: the root may be read-only.
FROM robot AS ros
USER 0
# hadolint ignore=DL3008
RUN apt-get update && apt-get install --yes --no-install-recommends \
        python3-rosmaster python3-rospy python3-rosservice python3-rostopic python3-sensor-msgs python3-std-srvs \
    && rm -rf /var/lib/apt/lists/*
ENV ROS_LOG_DIR=/dev/shm TMPDIR=/dev/shm ROS_PACKAGE_PATH=/opt/iiwa-sim/lib/python/site-packages/iiwa_sim/protocol/rmi
USER 10001
ENTRYPOINT ["iiwa-sim", "--ros"]

# docker build --target ros2: a node of ROS 2 (x86-64). Others are met in the container's network.
FROM robot AS ros2
COPY --from=build-ros2 /opt/ros2 /opt/ros2
ENV ROS_LOG_DIR=/dev/shm/ros ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET
ENTRYPOINT ["iiwa-sim", "--ros2", "--ros2-python", "/opt/ros2/bin/python"]

FROM robot
