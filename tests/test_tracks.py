"""Tracks of GPS devices as overlays, and files that are refused."""

import gzip
import io
import zipfile

import numpy as np
import pytest
from rasters import spaced, write_raster

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers.georeference import DEGREES, Georeference, Grid
from terrain_gl.renderer import overlay
from terrain_gl.renderer.overlay import read_overlay

GPX = """<?xml version="1.0" encoding="UTF-8"?>
<!-- by hand -->
<gpx version="1.{minor}" creator="me" xmlns="http://www.topografix.com/GPX/1/{minor}">
  <wpt lat="46.004" lon="7.002"><ele>9</ele><name>Hut &amp; spring</name></wpt>
  <rte><rtept lat="46.001" lon="7.001"/><rtept lat="46.002" lon="7.003"/></rte>
  <trk><name>way</name>
    <trkseg><trkpt lat="46.001" lon="7.001"><ele>5</ele></trkpt><trkpt lat="46.003" lon="7.004"/></trkseg>
    <trkseg><trkpt lat="46.004" lon="7.004"/><trkpt lat="46.005" lon="7.004"/><trkpt lat="46.005" lon="7.005"/></trkseg>
  </trk>
</gpx>
"""
KML = """<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Document>
  <Placemark><Point><coordinates>7.002,46.004,12</coordinates></Point></Placemark>
  <Placemark><LineString><coordinates>
    7.001,46.001,0 7.003, 46.002,0
    7.004,46.002,0</coordinates></LineString></Placemark>
  <Placemark><gx:Track><when>2026-01-01</when><gx:coord>7.001 46.001 3</gx:coord><gx:coord>7.004 46.003 3</gx:coord>
  </gx:Track></Placemark></Document></kml>
"""
TCX = """<TrainingCenterDatabase xmlns="http://www.garmin.com/xmlschemas/TrainingCenterDatabase/v2"><Activities><Activity>
  <Lap><Track>{points}<Trackpoint><Time>no position</Time></Trackpoint></Track></Lap></Activity></Activities>
</TrainingCenterDatabase>
"""
POINT = (
    "<Trackpoint><Position><LatitudeDegrees>{}</LatitudeDegrees><LongitudeDegrees>{}</LongitudeDegrees></Position>"
    "</Trackpoint>"
)


@pytest.fixture
def degrees():
    """101 × 101 posts every 0.0001 degrees, from 7 E and 46.01 N on."""
    heightmap = Heightmap(np.zeros((101, 101), "f4"), 10.0)
    heightmap.georeference = Georeference(Grid(1e-4, 0.0, 7 - 5e-5, 0.0, -1e-4, 46.01 + 5e-5), DEGREES, (101, 101))
    return heightmap


def posts(*lonlats):
    return np.array([[(lon - 7) * 1e4, (46.01 - lat) * 1e4] for lon, lat in lonlats])


def read(text, heightmap, tmp_path, encoding="utf-8"):
    path = tmp_path / "way.xml"
    path.write_bytes(text.encode(encoding))
    return read_overlay(path, heightmap)


@pytest.mark.parametrize("minor", [0, 1])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_gpx_has_tracks_by_segments_routes_and_waypoints(degrees, tmp_path, minor, encoding):
    found = read(GPX.format(minor=minor), degrees, tmp_path, encoding)
    assert sorted(len(line) for line in found.lines) == [2, 2, 3]
    assert found.points == pytest.approx(posts((7.002, 46.004)), abs=1e-3)
    assert found.lines[1] == pytest.approx(posts((7.001, 46.001), (7.004, 46.003)), abs=1e-3)


def test_kml_has_lines_points_and_tracks(degrees, tmp_path):
    found = read(KML, degrees, tmp_path)
    assert [len(line) for line in found.lines] == [3, 2]
    assert found.points == pytest.approx(posts((7.002, 46.004)), abs=1e-3)
    assert found.lines[0][0] == pytest.approx(posts((7.001, 46.001))[0], abs=1e-3)


def test_a_kmz_is_read_as_its_first_kml(degrees, tmp_path):
    for texts in ({"doc.kml": KML, "files/other.kml": "<kml/>"}, {"picture.png": "", "doc.kml": KML}):
        (tmp_path / "way.kmz").write_bytes(zipped(texts))
        assert [len(line) for line in read_overlay(tmp_path / "way.kmz", degrees).lines] == [3, 2]


def sentence(kind, k, valid):
    """An NMEA sentence of a fix at 7.00k° E, 46.00k° N."""
    at = f"46{0.06 * k:07.4f},N,007{0.06 * k:07.4f},E"
    return (
        f"$GP{kind},120000,A,{at},0,0,010126,,*00"
        if kind == "RMC"
        else f"$GN{kind},120000,{at},{valid},8,1,545,M,,M,,*47"
    )


def fix(k, side="N"):
    return f"B12000{k}4600{60 * k:03d}{side}00700{60 * k:03d}EA0050000500"


NMEA = [sentence("GGA", k, 1) for k in (1, 2, 3)]
TEXTS = {
    "GGA and RMC": "\r\n".join([*NMEA, *(sentence("RMC", k, 1) for k in (1, 2, 3)), "$GPGSV,3,1,11*74"]),
    "GGA alone": "\r\n".join([sentence("GGA", 9, 0), *NMEA]),
    "IGC": "\n".join(["AXXX001", "HFDTE010126", *map(fix, (1, 2, 3)), "LXXX"]),
}


@pytest.mark.parametrize("name", TEXTS)
def test_lines_of_text_are_one_track(degrees, tmp_path, name):
    """The same fixes in each format; GGA sentences of quality 0 have none."""
    (line,) = read(TEXTS[name], degrees, tmp_path).lines
    assert line == pytest.approx(posts(*((7 + 0.001 * k, 46 + 0.001 * k) for k in (1, 2, 3))), abs=0.02)


def test_texts_of_the_south_and_west(degrees, tmp_path):
    (line,) = read("\n".join(fix(k, "S") for k in (1, 2)), degrees, tmp_path).lines
    assert line == pytest.approx(posts((7.001, -46.001), (7.002, -46.002)), abs=0.02)


def test_a_packed_track_is_read(degrees, tmp_path):
    text = GPX.format(minor=1)
    for content in (zipped({"readme.txt": "", "way.gpx": text}), gzip.compress(text.encode())):
        (tmp_path / "way").write_bytes(content)
        assert len(read_overlay(tmp_path / "way", degrees).lines) == 3


def zipped(texts):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in texts.items():
            archive.writestr(name, text)
    return content.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        zipped({"a.tif": ""}),
        zipped({"a.kml": KML})[:200],
        b"PK\3\4",
        zipped({"a.kml": "<gpx"}),
        gzip.compress(b"a" * 99, mtime=0)[:20],
    ],
)
def test_other_archives_are_refused_in_one_line(degrees, tmp_path, content):
    (tmp_path / "way.kmz").write_bytes(content)
    with pytest.raises(TerrainError, match="way.kmz: [^\n]*$"):
        read_overlay(tmp_path / "way.kmz", degrees)


def test_an_archive_unpacks_to_a_limit(degrees, tmp_path, monkeypatch):
    monkeypatch.setattr(overlay, "MAX_BYTES", 1 << 20)
    (tmp_path / "way.kmz").write_bytes(zipped({"a.kml": " " * (1 << 21)}))
    with pytest.raises(TerrainError, match="a.kml unpacks to more than 1 MiB"):
        read_overlay(tmp_path / "way.kmz", degrees)


def test_tcx_leaves_out_points_without_a_position(degrees, tmp_path):
    points = "".join(POINT.format(46 + 0.001 * k, 7.002) for k in range(1, 4))
    found = read(TCX.format(points=points), degrees, tmp_path)
    (line,) = found.lines
    assert line == pytest.approx(posts((7.002, 46.001), (7.002, 46.002), (7.002, 46.003)), abs=1e-3)


BOMB = '<!DOCTYPE gpx [<!ENTITY a "{}"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'.format("x" * 999)
OUTSIDE = '<!DOCTYPE gpx SYSTEM "file:///etc/passwd">'


@pytest.mark.parametrize("doctype", [BOMB, OUTSIDE, "<!DOCTYPE gpx>"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_doctype_is_refused_in_one_line(degrees, tmp_path, doctype, encoding):
    text = doctype + "<gpx><wpt lat='46.004' lon='7.002'><name>&b;</name></wpt></gpx>"
    with pytest.raises(TerrainError, match="way.xml: it has a DOCTYPE") as caught:
        read(text, degrees, tmp_path, encoding)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GPX.format(minor=1)[:300], "no whole XML"),
        ("<html><body/></html>", "XML of the kind 'html', not GPX, KML or TCX"),
        ("<gpx><wpt lat='north' lon='7'/></gpx>", "could not convert"),
        ("<gpx><rte><rtept lat='46'/><rtept lat='46' lon='7'/></rte></gpx>", "no longitude"),
        ("<gpx><wpt lat='nan' lon='7'/></gpx>", "not pairs of numbers"),
        ("<gpx>" + 5000 * "<a>", "no whole XML"),
        (
            "no file of any kind",
            "is no GeoJSON, and no GPX, KML, TCX, NMEA or IGC: convert it with gpsbabel, or ogr2ogr -f GeoJSON",
        ),
    ],
)
def test_other_files_are_refused_in_one_line(degrees, tmp_path, text, words):
    with pytest.raises(TerrainError, match=words) as caught:
        read(text, degrees, tmp_path)
    assert "\n" not in str(caught.value) and "way.xml" in str(caught.value)


def test_a_track_is_drawn(folder, run):
    from terrain_gl.image import read_image

    write_raster("dem.tif", np.zeros((61, 61), "f4"), spaced(1e-4, 7, 46.0061), "EPSG:4326")
    (folder / "way.gpx").write_text(GPX.format(minor=1), encoding="utf-8")
    shared = "dem.tif", "--style", "lambert", "--size", "160x90", "--at=7.003,46.003"
    assert run("shot", *shared, "-o", "without.png")[0] == 0
    assert run("shot", *shared, "--overlay", "way.gpx", "-o", "with.png")[0] == 0
    assert (read_image("without.png") != read_image("with.png")).any(-1).sum() > 50
