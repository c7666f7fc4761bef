# The course and the program with Mesa's software OpenGL, for classes: see course/SETUP.md.
FROM debian:bookworm-slim
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3-venv libegl1 libgl1 libgl1-mesa-dri util-linux \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /terrain-gl
COPY . .
RUN python3 -m venv /opt/venv && /opt/venv/bin/pip install --no-cache-dir -e '.[compare]' \
    && useradd --create-home student && chown -R student course
USER student
ENV PATH=/opt/venv/bin:$PATH PYTHONDONTWRITEBYTECODE=1 MPLCONFIGDIR=/tmp
CMD ["python", "-m", "course", "check", "2"]
