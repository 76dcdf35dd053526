# Asset2Sim with everything that a night needs; the laboratory and the tests are left out.
#
#     docker build -t asset2sim .
#     docker run --rm -v "$PWD/data/raw:/data:ro" -v "$PWD/out:/out" asset2sim refine /data --out /out
FROM python:3.11-slim

# SAPIEN's and USD's libraries name X11's, without a display.
RUN apt-get update && apt-get install --yes --no-install-recommends libx11-6 && rm -rf /var/lib/apt/lists/*
RUN useradd --create-home --uid 1000 asset2sim \
  && mkdir /out /home/asset2sim/.prefect /home/asset2sim/.cache \
  && chown asset2sim /out /home/asset2sim/.prefect /home/asset2sim/.cache

WORKDIR /app
COPY constraints.txt pyproject.toml CHANGELOG.md README.md LICENSE catalog.yaml ./
COPY schemas schemas
COPY asset2sim asset2sim
COPY tasks tasks
COPY flows flows
RUN pip install --no-cache-dir --constraint constraints.txt '.[pipeline,engines,usd,view,s3]'

USER asset2sim
WORKDIR /home/asset2sim
# Prefect writes its pages anew before it serves them, by default into its package, which is root's.
ENV HOME=/home/asset2sim PREFECT_HOME=/home/asset2sim/.prefect PREFECT_UI_STATIC_DIRECTORY=/home/asset2sim/.prefect/ui
# Report, Prefect, MLflow of `ui --host 0.0.0.0`; the viewer.
EXPOSE 4100 4200 5000 8080
# Of `ui`: Prefect's page answers. Other commands need none: docker run --no-healthcheck.
HEALTHCHECK --interval=30s --timeout=5s --start-period=120s \
  CMD ["python", "-c", "import urllib.request as u; u.urlopen('http://127.0.0.1:4200/api/health', timeout=4)"]
ENTRYPOINT ["asset2sim"]
CMD ["--help"]
