FROM python:3.13-slim AS build

# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends binutils libgomp1 rdfind \
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


FROM python:3.13-slim

# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libgomp1 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --uid 10001 --no-create-home --shell /usr/sbin/nologin iiwa
COPY --from=build /opt/iiwa-sim /opt/iiwa-sim
ENV PATH=/opt/iiwa-sim/bin:$PATH
USER 10001

EXPOSE 30000 9090
HEALTHCHECK --interval=10s --timeout=5s --start-period=10s \
    CMD ["python", "-c", "from iiwa_sim.client import Iiwa; Iiwa('127.0.0.1', 30000, 3).hello()"]
ENTRYPOINT ["iiwa-sim", "--host", "0.0.0.0"]
