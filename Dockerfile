# ptm in a container, with its loops compiled:
#
#     docker build -t ptmtools .
#     docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/data" ptmtools build-scene museum.obj
#     docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/data" -p 8000:8000 ptmtools \
#         serve museum.db --host 0.0.0.0 --port 8000
#
# Without the readers of IFC and USD it has 0.4 GB less: docker build --build-arg EXTRAS=light,plot …
FROM python:3.12-slim AS wheel
WORKDIR /source
COPY . .
RUN pip install --no-cache-dir build && python -m build --wheel --outdir /wheel .

FROM python:3.12-slim
ARG EXTRAS=light,plot,ifc,usd
# What pymeshlab and moderngl load.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libegl1 libgl1 libgl1-mesa-dri libopengl0 \
    && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=wheel,source=/wheel,target=/wheel \
    wheel=$(echo /wheel/*.whl) && pip install --no-cache-dir "$wheel[$EXTRAS]"
# Any user may run it, also one without a name and a home. The machine code is compiled here once,
# and each user can add that for another processor.
ENV NUMBA_CACHE_DIR=/var/cache/ptmtools
RUN mkdir "$NUMBA_CACHE_DIR" && ptm warm-up && chmod -R a+rwX "$NUMBA_CACHE_DIR"
ENV HOME=/tmp
USER 1000:1000
WORKDIR /data
ENTRYPOINT ["ptm"]
CMD ["--help"]
