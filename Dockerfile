FROM python:3.13-slim-bookworm AS build

# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends binutils gcc libc6-dev libgomp1 rdfind \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /src
RUN python -m venv /opt/iiwa-sim

# The libraries on their own: a change of our code does not fetch them again.
COPY pyproject.toml ./
RUN python -c "import tomllib; p = tomllib.load(open('pyproject.toml', 'rb'))['project']; \
        print(*p['dependencies'], *p['optional-dependencies']['rosbridge'], sep='\n')" \
        > libraries.txt \
    && /opt/iiwa-sim/bin/pip install --no-cache-dir --requirement libraries.txt

# Headers, static libraries and tests go, a library under three names becomes links to one, symbols go.
# The .pyc files stay: they halve the start.
WORKDIR /opt/iiwa-sim/lib/python3.13/site-packages
RUN rm -rf include cmeel.prefix/bin cmeel.prefix/share \
    && find . -type d '(' -name include -o -name tests -o -name cmake -o -name pkgconfig ')' -prune -exec rm -rf {} + \
    && find . -name '*.a' -delete \
    && rdfind -makesymlinks true -makeresultsfile false cmeel.prefix \
    && find cmeel.prefix -type f -name '*.so*' -exec strip --strip-unneeded {} +

WORKDIR /src
COPY . .
RUN /opt/iiwa-sim/bin/pip install --no-cache-dir --no-deps . \
    && /opt/iiwa-sim/bin/python -c "import iiwa_sim.simulator" \
    && /opt/iiwa-sim/bin/pip uninstall --yes pip


FROM python:3.13-slim-bookworm AS robot

# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libgomp1 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --uid 10001 --no-create-home --shell /usr/sbin/nologin iiwa
COPY --from=build /opt/iiwa-sim /opt/iiwa-sim
ENV PATH=/opt/iiwa-sim/bin:$PATH
USER 10001

EXPOSE 30000 54600 9090
HEALTHCHECK --interval=10s --timeout=5s --start-period=10s \
    CMD ["iiwa-sim", "health"]
ENTRYPOINT ["iiwa-sim", "--host", "0.0.0.0"]


# docker build --target ros: a node of ROS 1, with a master and the tools to try it with. Debian 12 has these packages.
FROM robot AS ros

USER 0
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        python3-rosmaster python3-rospy python3-rosservice python3-rostopic python3-sensor-msgs python3-std-srvs \
    && rm -rf /var/lib/apt/lists/*
ENV ROS_LOG_DIR=/tmp/ros \
    ROS_PACKAGE_PATH=/opt/iiwa-sim/lib/python3.13/site-packages/iiwa_sim/protocol/rmi
USER 10001
ENTRYPOINT ["iiwa-sim", "--host", "0.0.0.0", "--ros"]


# What is built where no target is named.
FROM robot
