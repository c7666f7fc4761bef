# The course and the program with Mesa's software OpenGL, for classes: see course/SETUP.md.
FROM python:3.12-slim-bookworm
RUN apt-get update \
    && apt-get install -y --no-install-recommends libegl1 libgl1 libgl1-mesa-dri util-linux \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /terrain-gl
COPY . .
RUN pip install --no-cache-dir -e '.[compare]' && useradd --create-home student && chown -R student course
USER student
ENV PYTHONDONTWRITEBYTECODE=1 MPLCONFIGDIR=/tmp
CMD ["python", "-m", "course", "check", "2"]
