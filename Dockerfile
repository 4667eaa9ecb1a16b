# The main job as a container that ends when the job is done:
#   docker build -t pinn-ray . && mkdir -p out && docker run --rm --user "$(id -u)" -v "$PWD/out:/out" pinn-ray
# Another job: docker run ... pinn-ray compare --design slender. Where pip needs settings or certificates of its own, give
# them to the build: --secret id=pip,src=pip.conf --secret id=ca,src=ca.crt
FROM debian:trixie-slim

COPY requirements/debian13.apt /tmp/
RUN apt-get update \
    && DEBIAN_FRONTEND=noninteractive xargs apt-get install -y --no-install-recommends </tmp/debian13.apt \
    && apt-get clean && rm -rf /var/lib/apt/lists/*

COPY requirements/debian13.txt /tmp/
ENV PATH=/venv/bin:$PATH
RUN --mount=type=secret,id=pip,target=/etc/pip.conf,required=false \
    --mount=type=secret,id=ca,required=false \
    if [ -f /run/secrets/ca ]; then export PIP_CERT=/run/secrets/ca; fi \
    && python3 -m venv --system-site-packages /venv \
    && pip install --no-cache-dir --no-deps -r /tmp/debian13.txt

COPY . /tmp/pinn-ray
RUN pip install --no-cache-dir --no-deps --no-build-isolation /tmp/pinn-ray && mkdir -m 1777 /out && rm -r /tmp/*

# Any user may run it (--user), known to the system or not, so the caches go to /tmp. Open MPI is told to stay on this
# machine and VTK to draw without a display: both warn otherwise.
USER nobody
ENV HOME=/tmp USER=nobody OMPI_MCA_btl=self,sm VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow
WORKDIR /
CMD ["compare", "--design", "default"]
