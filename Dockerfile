# The main job as a container that ends when the job is done:
#   docker build -t pinn-ray . && mkdir -p out && docker run --rm --user "$(id -u)" -v "$PWD/out:/out" pinn-ray
# Another job: docker run ... pinn-ray compare --design slender. Where pip needs settings or certificates of its own, give
# them to the build: --secret id=pip,src=pip.conf --secret id=ca,src=ca.crt
#
# --build-arg BASE=dolfinx/dolfinx:stable takes the image of the FEniCS project, or another of Debian's family in which
# `python3 -c "import dolfinx"` and pip work. It keeps its DOLFINx; the other packages are then the newest that pip finds,
# not those of the lock, and torch is several GB unless --build-arg TORCH_INDEX names an index of its CPU build.
ARG BASE=debian:trixie-slim
FROM ${BASE}

COPY requirements/debian13.apt requirements/debian13.txt /tmp/
RUN if python3 -c "import dolfinx" 2>/dev/null; then sed -i '/^python3-/d' /tmp/debian13.apt; else touch /tmp/locked; fi \
    && apt-get update \
    && DEBIAN_FRONTEND=noninteractive xargs apt-get install -y --no-install-recommends </tmp/debian13.apt \
    && apt-get clean && rm -rf /var/lib/apt/lists/* /var/log/* /var/cache/ldconfig/aux-cache

# With it compiled modules tell the hash of their source instead of its time.
ARG SOURCE_DATE_EPOCH
ENV PATH=/venv/bin:$PATH
RUN --mount=type=secret,id=pip,target=/etc/pip.conf,required=false \
    --mount=type=secret,id=ca,required=false \
    if [ -f /run/secrets/ca ]; then export PIP_CERT=/run/secrets/ca; fi \
    && if [ -f /tmp/locked ]; then python3 -m venv --system-site-packages /venv \
    && pip install --no-cache-dir --no-deps -r /tmp/debian13.txt; fi

ARG TORCH_INDEX
COPY . /tmp/pinn-ray
RUN --mount=type=secret,id=pip,target=/etc/pip.conf,required=false \
    --mount=type=secret,id=ca,required=false \
    if [ -f /run/secrets/ca ]; then export PIP_CERT=/run/secrets/ca; fi \
    && if [ -f /tmp/locked ]; then how="--no-deps --no-build-isolation"; fi \
    && pip install --no-cache-dir ${how} ${TORCH_INDEX:+--extra-index-url "$TORCH_INDEX"} /tmp/pinn-ray \
    && mkdir -m 1777 /out && rm -r /tmp/*

# The licences are those of this project and of the strictest parts inside: Gmsh, the codecs x264 and x265 of PyAV's wheel.
ARG BASE
ARG VERSION=0.1.0
ARG REVISION
ARG CREATED
ARG SOURCE
LABEL org.opencontainers.image.title="pinn-ray" \
    org.opencontainers.image.description="Compares finite elements and neural networks on the Fin Ray soft finger" \
    org.opencontainers.image.authors="pinn-ray contributors" \
    org.opencontainers.image.licenses="MIT AND GPL-3.0-or-later" \
    org.opencontainers.image.version="$VERSION" \
    org.opencontainers.image.revision="$REVISION" \
    org.opencontainers.image.created="$CREATED" \
    org.opencontainers.image.source="$SOURCE" \
    org.opencontainers.image.base.name="$BASE"

# Any user may run it (--user), known to the system or not, so the caches go to /tmp. Open MPI is told to stay on this
# machine and VTK to draw without a display: both warn otherwise.
USER nobody
ENV HOME=/tmp USER=nobody OMPI_MCA_btl=self,sm VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow
WORKDIR /
CMD ["compare", "--design", "default"]
