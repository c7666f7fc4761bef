"""Example 7: light
================

One mountain at six hours of a day in June.

::

    date, hour, latitude -> sun -> sky -> lobes -> light

The place of the sun follows from date, hour and latitude. A clear sky is computed for this sun, and the colours of nine
fixed lobes are fitted to the sky. For the ground under a pixel, summed-area tables give the share of each lobe that the
land does not hide, and the mean of the ground's lobes. These tables are made once for a map. So from hour to hour only
ten colours (of the sky's lobes and of the surrounding land) and the sun's shadows are new.

Run: ``python 07_light.py [PICTURE.png [MAP]]``
"""

import sys
from datetime import datetime

import numpy as np

from terrain_gl import Heightmap, Renderer
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png
from terrain_gl.light.sun import sun_position

HOURS, LATITUDE = (4.6, 6, 9, 14, 19, 20.2), 47.0

picture = sys.argv[1] if len(sys.argv) > 1 else "07_light.png"
name = sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"
known = bundled()[name]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)

views = []
with Renderer(terrain, size=(480, 270)) as renderer:
    for hour in HOURS:
        sun = sun_position(datetime(2026, 6, 21, int(hour), round(hour % 1 * 60)), LATITUDE)
        frame = renderer.render(known.camera, sun=sun)
        views.append(frame.image)
        error = renderer.picture.lighting.sky.fit_error
        clock = f"{int(hour):2}:{round(hour % 1 * 60):02}"
        print(f"{clock}  sun {sun[0]:5.1f}, {sun[1]:5.1f}  lobes within {100 * error:.1f} %")

write_png(picture, np.concatenate([np.concatenate(views[i : i + 2], 1) for i in (0, 2, 4)]))
print("wrote", picture)
