# SPDX-License-Identifier: BSD-3-Clause
# docker build -t plumbline . && docker run --rm -v "$PWD:/work" plumbline map recording -o out
# The first stage makes the packages, the second one installs them. tests/packaging/run_packages.py runs the second one's
# steps without a Docker engine.
FROM debian:bookworm-slim AS build
COPY . /source
WORKDIR /source
RUN apt-get update && scripts/package /packages

FROM debian:bookworm-slim
COPY --from=build /packages /packages
RUN apt-get update \
 && apt-get install -y --no-install-recommends /packages/plumbline_*.deb /packages/plumbline-net_*.deb /packages/plumbline-ros1_*.deb /packages/python3-plumbline_*.deb \
 && rm -rf /packages /var/lib/apt/lists/* \
 && useradd --create-home --uid 1000 plumbline
USER plumbline
WORKDIR /work
ENTRYPOINT ["plumbline"]
CMD ["--help"]
