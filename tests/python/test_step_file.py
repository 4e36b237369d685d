"""STEP files against an independent kernel (OpenCascade), and its volumes against closed forms.

The example `step_parts` makes parts by hand; its sizes, in mm, stand in its comments.
"""

import math
import subprocess

import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GeomAbs import GeomAbs_CurveType, GeomAbs_SurfaceType
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_DocumentTool
from OCP.collections import Sequence_TDF_Label
from scipy.integrate import quad

PLANE, CYLINDER, CONE, SPHERE = (getattr(GeomAbs_SurfaceType, f"GeomAbs_{name}") for name in ("Plane", "Cylinder", "Cone", "Sphere"))
ELLIPSE, SPLINE = GeomAbs_CurveType.GeomAbs_Ellipse, GeomAbs_CurveType.GeomAbs_BSplineCurve
# of numbers that pass through unit vectors and radii in mm
ROUNDING = 1e-12
# of volumes: Gauss points of OpenCascade on curved faces
VOLUME = 1e-6
OF_TIP = 59.0


def all_of(shape, kind):
    """Its parts of a kind: one that several faces share is there once for each."""
    explorer, found = TopExp_Explorer(shape, kind), []
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


class Part:
    """A file as OpenCascade reads it."""

    def __init__(self, path):
        self.text = path.read_text()
        reader = STEPControl_Reader()
        assert reader.ReadFile(str(path)) == IFSelect_RetDone
        reader.TransferRoots()
        self.shape = reader.OneShape()
        transfer = reader.WS().TransferReader()
        self.faces = {}
        for face in all_of(self.shape, TopAbs_FACE):
            name = transfer.EntityFromShapeResult(face, 1).Name().ToCString()
            self.faces[name] = BRepAdaptor_Surface(TopoDS.Face(face))
        self.curves = [BRepAdaptor_Curve(TopoDS.Edge(edge)) for edge in all_of(self.shape, TopAbs_EDGE)]

    def kinds(self):
        kinds = [surface.GetType() for surface in self.faces.values()]
        return {kind: kinds.count(kind) for kind in set(kinds)}

    def volume(self):
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(self.shape, properties, 1e-9)
        return properties.Mass()

    def free_edges(self):
        """Number of edges of one face alone; a seam has its face twice."""
        edges = [edge for edge in all_of(self.shape, TopAbs_EDGE) if not BRep_Tool.Degenerated_s(TopoDS.Edge(edge))]
        return sum(sum(edge.IsSame(other) for other in edges) == 1 for edge in edges)


@pytest.fixture(scope="module")
def folder(touchup_bin, tmp_path_factory):
    """The files of the example."""
    program = touchup_bin.parent / "examples/step_parts"
    assert program.is_file(), f"{program} is not there: cargo build --workspace --examples"
    out = tmp_path_factory.mktemp("step")
    subprocess.run([str(program), str(out)], check=True, timeout=60)
    return out


@pytest.fixture(scope="module")
def part(folder):
    """Reads a part by its name."""
    return lambda name: Part(folder / f"{name}.step")


def crossing_volume(large, small):
    """Common volume of two cylinders that cross at right angles: chords of both over their common direction."""
    return 8 * quad(lambda y: math.sqrt((large**2 - y**2) * (small**2 - y**2)), 0, small, epsabs=1e-12)[0]


def of_plate():
    tip = math.pi * 25 * (5 / math.tan(math.radians(OF_TIP))) / 3
    return 60 * 40 * 20 - math.pi * 16 * 20 - math.pi * 25 * 12 - tip


def of_spheres():
    # caps of 8 at a radius of 13, out and in, cancel
    return 80 * 40 * 20 - math.pi * 4 * 8 - 2 * math.pi * 8 / 3


CLOSED = {
    "box": (10 * 20 * 30, {PLANE: 6}),
    "plate": (of_plate(), {PLANE: 6, CYLINDER: 2, CONE: 1}),
    "counterbore": (math.pi * (225 * 20 - 9 * 15 - 36 * 5), {PLANE: 3, CYLINDER: 3}),
    "slot": ((40 * 30 - 12 * 8 - math.pi * 16) * 10, {PLANE: 8, CYLINDER: 2}),
    "oblique": (math.pi * 25 * 20, {PLANE: 2, CYLINDER: 1}),
    "spheres": (of_spheres(), {PLANE: 6, CYLINDER: 1, SPHERE: 3}),
    "ball": (math.pi * 500 / 3, {SPHERE: 1}),
    "crossed": (math.pi * 3000 - crossing_volume(10, 4), {PLANE: 2, CYLINDER: 2}),
}


@pytest.mark.parametrize("name", CLOSED)
def test_a_closed_shell_is_a_valid_solid_with_its_faces_and_volume(part, name):
    volume, kinds = CLOSED[name]
    read = part(name)
    assert BRepCheck_Analyzer(read.shape).IsValid()
    assert len(all_of(read.shape, TopAbs_SOLID)) == len(all_of(read.shape, TopAbs_SHELL)) == 1
    assert all_of(read.shape, TopAbs_SHELL)[0].Closed()
    assert read.free_edges() == 0
    assert read.kinds() == kinds
    assert read.volume() == pytest.approx(volume, rel=VOLUME)
    assert "ADVANCED_BREP_SHAPE_REPRESENTATION" in read.text


def test_an_open_shell_stays_open(part):
    read = part("tray")
    assert BRepCheck_Analyzer(read.shape).IsValid()
    assert (len(all_of(read.shape, TopAbs_SOLID)), len(all_of(read.shape, TopAbs_SHELL)), len(all_of(read.shape, TopAbs_FACE))) == (0, 1, 5)
    assert read.free_edges() == 4
    assert "MANIFOLD_SURFACE_SHAPE_REPRESENTATION" in read.text


def test_sizes_are_those_of_the_parts_in_mm(part):
    plate = part("plate").faces
    assert plate["through hole"].Cylinder().Radius() == pytest.approx(4, abs=ROUNDING)
    assert plate["blind hole"].Cylinder().Radius() == pytest.approx(5, abs=ROUNDING)
    tip = plate["drill tip"].Cone()
    assert math.degrees(tip.SemiAngle()) == pytest.approx(OF_TIP, abs=ROUNDING)
    assert tip.Apex().Z() == pytest.approx(8 - 5 / math.tan(math.radians(OF_TIP)), abs=ROUNDING)
    bottom, top = plate["bottom"].Plane(), plate["top"].Plane()
    assert bottom.Distance(top) == pytest.approx(20, abs=ROUNDING)
    axes = [plate[name].Cylinder().Axis().Location() for name in ("through hole", "blind hole")]
    assert axes[0].Distance(axes[1]) == pytest.approx(27, abs=ROUNDING)
    spheres = part("spheres").faces
    assert [spheres[name].Sphere().Radius() for name in ("dome", "seat", "nose")] == pytest.approx([13, 13, 2], abs=ROUNDING)
    assert spheres["seat"].Sphere().Location().Z() == pytest.approx(25, abs=ROUNDING)



def test_curves_are_those_of_the_surfaces(part):
    ellipses = [curve.Ellipse() for curve in part("oblique").curves if curve.GetType() == ELLIPSE]
    assert ellipses
    for ellipse in ellipses:
        assert ellipse.MajorRadius() == pytest.approx(5 / math.cos(math.pi / 6), abs=ROUNDING)
        assert ellipse.MinorRadius() == pytest.approx(5, abs=ROUNDING)
    splines = [curve for curve in part("crossed").curves if curve.GetType() == SPLINE]
    # not the seams, which the reader adds; each mouth is of two faces
    ends = [(curve.FirstParameter(), curve.LastParameter(), curve) for curve in splines]
    mouths = [one for one in ends if one[2].Value(one[0]).Distance(one[2].Value(one[1])) < 1e-9]
    assert len(mouths) == 4
    for first, last, curve in mouths:
        for step in range(1001):
            point = curve.Value(first + (last - first) * step / 1000)
            off = [math.hypot(point.X(), point.Y()) - 10, math.hypot(point.Y(), point.Z() - 15) - 4]
            assert max(map(abs, off)) < 1e-5


def test_units_and_accuracy_are_stated(part):
    text = part("box").text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    assert "SI_UNIT($,.RADIAN.)" in text
    assert "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1" in text
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF" in text


def test_faces_keep_names_and_standard_uncertainties(part):
    read = part("plate")
    sides = {f"side {number}" for number in range(1, 5)}
    assert set(read.faces) == sides | {"bottom", "top", "through hole", "blind hole", "drill tip"}
    lines = dict(line.rstrip(";").split("=", 1) for line in read.text.splitlines() if line.startswith("#"))

    def properties(face):
        """Items of the property of a face, by the references of the file."""
        shape = next(key for key, line in lines.items() if line.startswith(f"ADVANCED_FACE('{face}'"))
        usage = next(line for line in lines.values() if line.startswith("GEOMETRIC_ITEM") and line.endswith(f",{shape})"))
        aspect = usage.split(",")[2]
        of_aspect = (key for key, line in lines.items() if line.startswith("PROPERTY_DEFINITION(") and line.endswith(f",{aspect})"))
        definition = next(of_aspect)
        link = next(line for line in lines.values() if line.startswith(f"PROPERTY_DEFINITION_REPRESENTATION({definition},"))
        representation = lines[link.rstrip(")").split(",")[1]]
        items = representation[representation.index("(#") + 1 :].split(")")[0].split(",")
        return [lines[item] for item in items]

    support, diameter, position = properties("through hole")
    assert support == "DESCRIPTIVE_REPRESENTATION_ITEM('support','touched')"
    assert diameter.startswith("MEASURE_REPRESENTATION_ITEM('diameter_mm',LENGTH_MEASURE(0.0031),#")
    assert "METRE" in lines[diameter.rstrip(")").split(",")[-1]]
    assert position.startswith("MEASURE_REPRESENTATION_ITEM('position_mm',LENGTH_MEASURE(1.E-7),#")
    _, angle = properties("drill tip")
    assert "PLANE_ANGLE_MEASURE(0.25)" in angle
    assert "'DEGREE'" in lines[angle.rstrip(")").split(",")[-1]]
    assert properties("top") == ["DESCRIPTIVE_REPRESENTATION_ITEM('support','scan')"]


def test_the_product_has_its_name_and_faces_two_colours(folder):
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetColorMode(True)
    reader.SetNameMode(True)
    assert reader.ReadFile(str(folder / "plate.step")) == IFSelect_RetDone
    assert reader.Transfer(document)
    colours = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ColorTool_s(document.Main()).GetColors(colours)
    assert colours.Length() == 2
    assert "PRODUCT('the \"plate\" of O''Neill, \\X2\\00D8\\X0\\'" in (folder / "plate.step").read_text()


def test_the_same_part_gives_the_same_bytes(folder, touchup_bin, tmp_path):
    subprocess.run([str(touchup_bin.parent / "examples/step_parts"), str(tmp_path)], check=True, timeout=60)
    for path in sorted(folder.iterdir()):
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()
