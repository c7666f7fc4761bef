"""Colours, widths and fills of overlays, as KML, simplestyle, and common writers of GPX give them."""

import json

import numpy as np
import pytest

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.draped import fills
from terrain_gl.renderer.overlay import read_overlay

RED, GREEN, BLUE = (255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255)
AREA = "<Polygon><outerBoundaryIs><LinearRing><coordinates>1,1 9,1 9,9 1,9 1,1</coordinates></LinearRing>"
AREA += "</outerBoundaryIs><innerBoundaryIs><LinearRing><coordinates>4,4 6,4 6,6 4,6 4,4</coordinates></LinearRing>"
AREA += "</innerBoundaryIs></Polygon>"
LINE = "<LineString><coordinates>1,1,0 9,9,0</coordinates></LineString>"
POINT = "<Point><coordinates>5,5</coordinates></Point>"


def style(line="ff0000ff", area="", width="", more=""):
    wide = f"<width>{width}</width>" if width else ""
    poly = f"<PolyStyle><color>{area}</color>{more}</PolyStyle>" if area else ""
    return f"<LineStyle><color>{line}</color>{wide}</LineStyle>{poly}"


def kml(mark, shared=""):
    return (
        f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{shared}<Placemark>{mark}</Placemark></Document></kml>'
    )


TRACK = '<gx:Track xmlns:gx="g"><gx:coord>1 1 0</gx:coord><gx:coord>9 9 0</gx:coord></gx:Track>'
MAP = '<StyleMap id="m"><Pair><key>highlight</key><styleUrl>#h</styleUrl></Pair><Pair><key>normal</key>'
MAP += "<styleUrl>#s</styleUrl></Pair></StyleMap>"
SHARED = f'<Style id="h">{style("ffff0000")}</Style><Style id="s">{style("ff00ff00", "80ff0000")}</Style>'
# a placemark, and shared styles; stroke, width and fill
KML = {
    "its own style": (kml(f"<Style>{style()}</Style>{LINE}"), RED, 1.0, None),
    "a shared style": (kml(f"<styleUrl>#s</styleUrl>{AREA}", SHARED), GREEN, 1.0, (0, 0, 255, 128)),
    "a style map": (kml(f"<styleUrl>#m</styleUrl>{AREA}", SHARED + MAP), GREEN, 1.0, (0, 0, 255, 128)),
    "a style of another file": (kml(f"<styleUrl>other.kml#s</styleUrl>{LINE}"), None, 1.0, None),
    "a wide line": (kml(f"<Style>{style(width='6')}</Style>{LINE}"), RED, 3.0, None),
    "no fill": (kml(f"<Style>{style(area='ff00ff00', more='<fill>0</fill>')}</Style>{AREA}"), RED, 1.0, None),
    "no outline": (kml(f"<Style>{style(area='ff00ff00', more='<outline>0</outline>')}</Style>{AREA}"), RED, 0.0, GREEN),
    "several geometries": (kml(f"<Style>{style()}</Style><MultiGeometry>{LINE}{LINE}</MultiGeometry>"), RED, 1.0, None),
    "an icon": (
        kml(f"<Style><IconStyle><color>ffff0000</color></IconStyle></Style>{POINT}"), BLUE, 1.0, None,
    ),
    "a track": (kml(f"<Style>{style()}</Style>{TRACK}"), RED, 1.0, None),
}  # fmt: skip


def land():
    """11 x 11 posts, one degree apart, from 0 to 10 degrees."""
    from terrain_gl.readers.georeference import DEGREES, Georeference, Grid

    heightmap = Heightmap(np.zeros((11, 11)), 1000.0)
    heightmap.georeference = Georeference(Grid(1.0, 0.0, -0.5, 0.0, -1.0, 10.5), DEGREES, (11, 11))
    return heightmap


def read(folder, name, text):
    (folder / name).write_text(text)
    return read_overlay(name, land())


@pytest.mark.parametrize("name", KML)
def test_styles_of_kml(folder, name):
    text, stroke, width, fill = KML[name]
    overlay = read(folder, "a.kml", text)
    assert len(overlay.styles) == len(overlay.lines) + len(overlay.points)
    for each in overlay.styles:
        assert (each.stroke, each.width, each.fill) == (stroke, width, fill)
    assert [colour for _, colour in overlay.areas] == ([fill] if fill else [])


SQUARE = [[1, 1], [9, 1], [9, 9], [1, 9], [1, 1]]
HOLE = [[4, 4], [6, 4], [6, 6], [4, 6], [4, 4]]
# properties of simplestyle; stroke, width and fill of a polygon
SIMPLE = {
    "stroke and fill": ({"stroke": "#ff0000", "fill": "#00ff00"}, RED, 1.0, (0, 255, 0, 153)),
    "short colours": ({"stroke": "f00", "fill": "#0f0", "fill-opacity": 1}, RED, 1.0, GREEN),
    "opacity and width": ({"stroke": "#0000ff", "stroke-opacity": 0.5, "stroke-width": 4}, (0, 0, 255, 128), 2.0, None),
    "marker-color": ({"marker-color": "#00ff00"}, GREEN, 1.0, None),
    "a name": ({"stroke": "red", "fill": "Blue", "fill-opacity": 1}, RED, 1.0, BLUE),
    "no colours": ({"stroke": "mauve", "stroke-width": "wide", "name": "x"}, None, 1.0, None),
    "numbers as text": ({"fill": "#0000ff", "fill-opacity": "1.0", "stroke-width": "0"}, None, 0.0, BLUE),
}


@pytest.mark.parametrize("name", SIMPLE)
@pytest.mark.parametrize("kind", ["Polygon", "MultiPolygon", "LineString", "Point"])
def test_simplestyle(folder, name, kind):
    properties, stroke, width, fill = SIMPLE[name]
    at = {"Polygon": [SQUARE, HOLE], "MultiPolygon": [[SQUARE, HOLE]], "LineString": SQUARE, "Point": SQUARE[0]}[kind]
    feature = {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": at}}
    overlay = read(folder, "a.geojson", json.dumps({"type": "FeatureCollection", "features": [feature]}))
    assert {(each.stroke, each.width, each.fill) for each in overlay.styles} == {(stroke, width, fill)}
    assert len(overlay.areas) == (fill is not None and kind.endswith("Polygon"))


GPX = '<gpx xmlns="http://www.topografix.com/GPX/1/1" creator="x">{}</gpx>'
SEGMENT = '<trkseg><trkpt lat="1" lon="1"/><trkpt lat="9" lon="9"/></trkseg>'
EXTENSIONS = {
    "Garmin": ('<g:TrackExtension xmlns:g="g"><g:DisplayColor>Red</g:DisplayColor></g:TrackExtension>', RED),
    "OsmAnd": ('<o:color xmlns:o="o">#ff0000ff</o:color>', BLUE),
    "OsmAnd, half opaque": ('<o:color xmlns:o="o">#800000ff</o:color>', (0, 0, 255, 128)),
    "GPX Style, half opaque": (
        '<s:line xmlns:s="s"><s:color>00FF00</s:color><s:opacity>0.5</s:opacity></s:line>',
        (0, 255, 0, 128),
    ),
    "GPX Style": ('<s:line xmlns:s="s"><s:color>00FF00</s:color><s:width>2</s:width></s:line>', GREEN),
    "none": ("<speed>3</speed>", None),
}  # fmt: skip


@pytest.mark.parametrize("name", EXTENSIONS)
def test_colours_of_gpx(folder, name):
    text, stroke = EXTENSIONS[name]
    plain = f"<trk>{SEGMENT}</trk>"
    overlay = read(folder, "a.gpx", GPX.format(f"<trk><extensions>{text}</extensions>{SEGMENT}</trk>{plain}"))
    assert [each.stroke for each in overlay.styles] == [stroke, None]


def test_a_style_of_a_gpx_file_is_that_of_all_its_tracks(folder):
    """As OsmAnd writes it, after the tracks."""
    of_file, own = EXTENSIONS["OsmAnd"][0], EXTENSIONS["Garmin"][0]
    tracks = f"<trk>{SEGMENT}</trk><trk><extensions>{own}</extensions>{SEGMENT}</trk>"
    overlay = read(folder, "a.gpx", GPX.format(f"{tracks}<extensions>{of_file}</extensions>"))
    assert [each.stroke for each in overlay.styles] == [BLUE, RED]


WAY = {"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": SQUARE[:2]}}


@pytest.mark.parametrize(("before", "between"), [("", "\n"), ("\x1e", "\n\x1e"), ("", "\r\n")])
def test_a_sequence_of_features(folder, before, between):
    overlay = read(folder, "a.geojsonl", before + between.join([json.dumps(WAY)] * 3) + "\n")
    assert len(overlay.lines) == 3


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_encodings_of_geojson(folder, encoding):
    (folder / "a.geojson").write_text(json.dumps(WAY), encoding=encoding)
    assert len(read_overlay("a.geojson", land()).lines) == 1


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.topojson", b'{"type": "Topology"}', "TopoJSON: .* ogr2ogr -f GeoJSON a.geojson a.topojson"),
        ("a.fgb", b"fgb\x03fgb\x01\xb4", "ogr2ogr -f GeoJSON a.geojson a.fgb"),
        ("a.gml", b"<FeatureCollection/>", "ogr2ogr -f GeoJSON"),
        ("a.gpkg", b"SQLite format 3\0", "is a database, [^;]*: ogr2ogr -f GeoJSON a.geojson a.gpkg$"),
        ("a.geojson", b"var x = {}", "has an error"),
        ("a.geojson", b'{"type": "Feature"', "breaks off"),
    ],
)
def test_other_kinds_are_told_the_next_step(folder, name, content, words):
    (folder / name).write_bytes(content)
    with pytest.raises(TerrainError, match=words) as caught:
        read_overlay(name, land())
    assert "codec" not in str(caught.value)


def test_fills_leave_holes_empty_and_lie_over_each_other(folder):
    first = {"type": "Polygon", "coordinates": [SQUARE, HOLE]}
    second = {"type": "Polygon", "coordinates": [[[5, 5], [9, 5], [9, 9], [5, 9], [5, 5]]]}
    features = [
        {"type": "Feature", "properties": {"fill": colour, "fill-opacity": opacity}, "geometry": geometry}
        for geometry, colour, opacity in ((first, "#ff0000", 1.0), (second, "#0000ff", 0.5))
    ]
    overlay = read(folder, "a.geojson", json.dumps({"type": "FeatureCollection", "features": features}))
    laid = fills((overlay,), land()).astype(float)
    per_post = laid.shape[0] / 11

    def at(lon, lat):
        return laid[int((10 - lat + 0.5) * per_post), int((lon + 0.5) * per_post)]

    half = 128 / 255
    assert at(2, 2) == pytest.approx([1, 0, 0, 1]) and at(0.2, 5) == pytest.approx([0, 0, 0, 0])
    assert at(4.5, 4.5) == pytest.approx([0, 0, 0, 0]), "the hole"
    assert at(8, 8) == pytest.approx([1 - half, 0, half, 1], abs=1e-3)
    assert at(5.5, 5.5) == pytest.approx([0, 0, half, half], abs=1e-3), "over the hole"
    assert fills((), land()) is None


def test_a_picture_shows_colours_and_fills(folder, ctx):
    squares = [[[x, 2], [x + 3, 2], [x + 3, 8], [x, 8], [x, 2]] for x in (1, 6)]
    features = [
        {
            "type": "Feature",
            "properties": {"stroke": colour, "fill": colour, "fill-opacity": 1},
            "geometry": {"type": "Polygon", "coordinates": [square]},
        }
        for colour, square in zip(("#ff0000", "#00ff00"), squares, strict=True)
    ]
    overlay = read(folder, "a.geojson", json.dumps({"type": "FeatureCollection", "features": features}))
    down = Camera((5000, 5000, 30000), (5000, 5000, 0), 18)
    with Renderer(land(), (100, 100), ctx=ctx) as renderer:
        bare = renderer.render(down, sun=(0, 80)).image[..., :3].astype(int)
        renderer.overlays = (overlay,)
        image = renderer.render(down, sun=(0, 80)).image[..., :3].astype(int)
        renderer.overlays = ()
        again = renderer.render(down, sun=(0, 80)).image[..., :3].astype(int)
    west, east = image[45:55, 20:30].mean((0, 1)), image[45:55, 70:80].mean((0, 1))
    assert west[0] > 1.5 * west[1] and east[1] > 1.5 * east[0]
    np.testing.assert_array_equal(bare, again)
