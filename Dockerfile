# ptm in a container, with its loops compiled:
#
#     docker build -t ptmtools .
#     docker run --rm -v "$PWD:/data" ptmtools build-scene /data/museum.obj
#     docker run --rm -v "$PWD:/data" -p 8000:8000 ptmtools serve /data/museum.db --host 0.0.0.0 --port 8000
FROM python:3.12-slim AS wheel
WORKDIR /source
COPY . .
RUN pip install --no-cache-dir build && python -m build --wheel --outdir /wheel .

FROM python:3.12-slim
# What pymeshlab and moderngl load.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libegl1 libgl1 libgl1-mesa-dri libopengl0 \
    && rm -rf /var/lib/apt/lists/*
COPY --from=wheel /wheel /wheel
RUN wheel=$(echo /wheel/*.whl) && pip install --no-cache-dir "$wheel[light,ifc,usd]" && rm -r /wheel
RUN useradd --create-home ptm
USER ptm
# Compiled once, for the user that runs it.
RUN ptm warm-up
WORKDIR /data
ENTRYPOINT ["ptm"]
CMD ["--help"]
