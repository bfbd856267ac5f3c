"""Tables of a drive line: what they give, and one line with row and column for what cannot be."""

import csv
import io

import pytest
from numpy.testing import assert_allclose
from refusals import given, refused

from gensig.driveline.drive_line import read_drive_line
from gensig.driveline.linear.stiffness_range import check_stiffness_range
from gensig.driveline.shaft_tables import read_shafting, shipped_tables
from gensig.errors import ConfigError, SimulationError
from gensig.plan.request import read_request

SHAFTING = """# a motor, two gears and a fan
node,name,inertia_kg_m2,speed_ratio,stiffness_knm_per_rad,edge_from,\
edge_to,edge_kind,teeth_from,teeth_to,loss_factor
1,motor,0.1,1,10,1,2,coupling,,,0.2
2,pinion,1e-3,1,1500,2,3,gear_mesh,20,40,
3,wheel,,0.5,20,3,4,shaft,,,
4,fan,0.2,0.5,,,,,,,
"""
GEARS = """node,name,n_teeth,normal_module_mm,pressure_angle_deg,helix_angle_deg,face_width_mm
2,pinion,20,2,20,0,20
3,wheel,40,2,20,0,20
"""


@pytest.fixture(scope="module")
def config():
    return read_request(["system=shaft_line"]).config


@pytest.fixture
def line_of(config, tmp_path):
    """The line of two tables, each written as given or with lines of it replaced."""

    def make(shafting=SHAFTING, gears=GEARS, **keys):
        (tmp_path / "line.csv").write_text(shafting, encoding="utf-8")
        (tmp_path / "gears.csv").write_text(gears, encoding="utf-8")
        files = {
            "shafting_csv": str(tmp_path / "line.csv"),
            "gears_csv": str(tmp_path / "gears.csv"),
        }
        return read_drive_line(config.with_keys("system", **{**files, **keys}))

    return make


def changed(table, change):
    """A table with the first place of ``old -> new`` changed, which it must have."""
    old, new = change.split(" -> ")
    assert old in table
    return table.replace(old, new, 1)


def test_a_line_is_read_with_its_units(line_of):
    read = line_of()
    line = read.line
    assert [node.name for node in line.nodes] == ["motor", "pinion", "wheel", "fan"]
    assert [shaft.stiffness for shaft in line.shafts] == [1e4, 2e4]
    assert [shaft.loss_factor for shaft in line.shafts] == [0.2, 0.03]
    radii = [gear.base_radius for gear in line.gears]
    assert_allclose(line.meshes[0].stiffness, 1.5e6 / (radii[0] * radii[1]), rtol=1e-12)
    assert line.meshes[0].loss_factor == 0.08
    assert line.meshes[0].backlash == pytest.approx(80e-6)
    assert read.mesh_orders == (20.0,)
    assert read.numbers == (1, 2, 3, 4)
    assert read.campbell_orders == (1.0, 2.0, 20.0, 40.0)


def test_what_is_empty_is_derived(line_of):
    """An inertia from the gear as a solid disc, a mesh stiffness from ISO 6336-1."""
    read = line_of(SHAFTING.replace("1500,2,3", ",2,3"))
    density = read_request([]).config["material"]["density_kg_per_m3"]
    radius, bore = 0.04, 0.02
    mass = density * 3.141592653589793 * (radius**2 - bore**2) * 0.02
    assert_allclose(
        read.line.nodes[2].inertia, 0.5 * mass * (radius**2 + bore**2), rtol=1e-9
    )
    assert_allclose(read.line.gears[1].mass, mass, rtol=1e-9)
    per_width = read.line.meshes[0].stiffness / 0.02
    assert (
        14e9 < per_width < 22e9
    )  # ISO's c_gamma of such steel gears is about 20 N/(mm um)


def test_header_units_are_read_as_they_are_written(line_of):
    milli = SHAFTING.replace("stiffness_knm_per_rad", "stiffness_nm_per_rad")
    one, other = line_of().line, line_of(milli).line
    assert_allclose(
        one.shafts[0].stiffness, 1e3 * other.shafts[0].stiffness, rtol=1e-12
    )


def test_rows_may_hold_only_a_joint_and_columns_stand_in_any_order(line_of):
    rows = list(csv.DictReader(SHAFTING.splitlines()[1:]))
    columns = list(rows[0])
    of_node = ("node", "name", "inertia_kg_m2", "speed_ratio")
    stream = io.StringIO()
    writer = csv.DictWriter(stream, columns[::-1])
    writer.writeheader()
    for row in rows:
        writer.writerow({key: row[key] for key in of_node})
    for row in rows[:3]:
        writer.writerow({key: row[key] for key in columns if key not in of_node})
    speeds = line_of(stream.getvalue()).line.speed_ratio
    assert speeds.tolist() == line_of().line.speed_ratio.tolist()


def test_the_ring_of_a_viscous_damper_counts_half(line_of):
    assert line_of(viscous_damper_node=1).line.nodes[0].inertia == pytest.approx(0.05)
    with pytest.raises(
        ConfigError, match=r"viscous_damper_node = 9: .* has no such node"
    ):
        line_of(viscous_damper_node=9)


BRANCH = "4,fan,0.2,0.5,10,4,5,shaft,,,\n5,pump,0.1,0.5,,,,,,,\n"
FORK = "4,fan,0.2,0.5,10,3,5,shaft,,,\n5,pump,0.1,0.5,,,,,,,\n"


@pytest.mark.parametrize(
    ("fan", "given", "ends"),
    [
        ("4,fan,0.2,0.5,,,,,,,\n", {}, (1, 4)),
        (BRANCH, {}, (1, 5)),
        (BRANCH, {"load_node": 4}, (1, 4)),
        (FORK, {}, (1, None)),  # 4 and 5 both end there
        (FORK, {"load_node": 5}, (1, 5)),
        (FORK, {"load_node": 1}, (None, 1)),
        ("4,fan,0.2,0.5,,,,,,,\n", {"dampers": True}, (1, 4)),
    ],
)
def test_motor_and_load_are_the_ends_of_an_unbranched_line(line_of, fan, given, ends):
    keys = dict(given)
    if keys.pop("dampers", False):
        damper = {
            "node": 4,
            "ring_inertia_kg_m2": 0.01,
            "damping_nms_per_rad": 1.0,
            "stiffness_nm_per_rad": 100.0,
        }
        keys["dampers"] = [damper]
    line = line_of(SHAFTING.replace("4,fan,0.2,0.5,,,,,,,\n", fan), **keys)
    assert (line.motor_node, line.load_node) == ends


def test_a_bare_name_is_a_shipped_table():
    assert (
        len(read_shafting("key", "engine_shafting"))
        == len(read_shafting("key", "engine_shafting.csv"))
        == 67
    )
    assert {"engine_gears.csv", "engine_shafting.csv", "two_stage_gears.csv"} <= set(
        shipped_tables()
    )


def test_shafts_alone_need_no_gears(line_of):
    plain = (
        "node,inertia_kg_m2,stiffness_nm_per_rad,edge_from,edge_to,edge_kind\n"
        "1,1,5,1,2,shaft\n"
        "2,1,,,,\n"
    )
    assert line_of(plain, gears_csv=None).line.n_loops == 0


LINE_REFUSED = {
    "4,fan,0.2 -> 4,fan,-0.2": r"row 6 \(node 4\), column inertia_kg_m2: -0.2 must be positive",
    "4,fan,0.2 -> 4,fan,0": r"row 6 \(node 4\), column inertia_kg_m2: 0 must be positive",
    "4,fan,0.2 -> 4,fan,heavy": r"row 6 \(node 4\), column inertia_kg_m2: 'heavy' is no number",
    "4,fan,0.2 -> 4,fan,inf": "'inf' is no number",
    "4,fan,0.2 -> 4,fan,": "column inertia_kg_m2: it is empty and node 4 has no gear",
    "4,fan -> 3,fan": "row 6 .*, column node: node 3 is there already, in row 5",
    "4,fan -> 4.5,fan": "column node: 4.5 must be a whole number",
    "4,fan -> ,fan": "row 6, column node: it is empty, but the row has an inertia",
    "3,4,shaft -> 3,7,shaft": (
        r"row 5 \(node 3\), column edge_to: there is no node 7; the table has 1, 2, 3, 4$"
    ),
    "3,4,shaft -> 3,3,shaft": "column edge_to: node 3 is joined to itself",
    "3,4,shaft -> 3,,shaft": "column edge_to: it is empty",
    "3,4,shaft -> 3,4,rope": "column edge_kind: 'rope'; allowed: shaft, coupling, rigid, gear_mesh",
    "20,3,4,shaft -> 20,,,": "column stiffness_knm_per_rad: a stiffness without edge_from",
    "20,3,4,shaft -> ,3,4,shaft": "column stiffness_knm_per_rad: it is empty; give a value",
    "20,3,4,shaft -> -20,3,4,shaft": "column stiffness_knm_per_rad: -20 must be positive",
    "20,3,4,shaft,, -> 20,3,4,shaft,20,": (
        "column teeth_from: that is of a gear_mesh, and edge_kind is shaft"
    ),
    ",,,0.2\n -> ,,,-0.2\n": "column loss_factor: -0.2 must not be negative",
    "20,3,4,shaft -> ,,,": r"row 6 \(node 4\), column edge_from: nothing joins node 4 to node 1",
    "fan,0.2,0.5 -> fan,0.2,2": (
        r"row 6 \(node 4\), column speed_ratio: 2 contradicts the tooth counts.* 0\.5 of"
    ),
    "wheel,,0.5 -> wheel,,0.51": r"row 5 \(node 3\), column speed_ratio: 0.51 contradicts",
    "gear_mesh,20,40 -> gear_mesh,20,41": (
        r"row 4 \(node 2\), column teeth_to: 41, but on .* wheel with 40"
    ),
    "gear_mesh,20,40 -> gear_mesh,19,40": "column teeth_from: 19, but on node 2 .* pinion with 20",
    "2,3,gear_mesh -> 1,3,gear_mesh": "column edge_from: .* has no gear on node 1",
    "inertia_kg_m2 -> inertia": "row 2, column inertia: its unit is missing; write inertia_kg_m2",
    "inertia_kg_m2 -> inertia_kgm2": (
        "row 2, column inertia_kgm2: no unit known here; write inertia_kg_m2"
    ),
    "inertia_kg_m2 -> inertia_kg": (
        "column inertia_kg: mass, not moment of inertia; write inertia_kg_m2"
    ),
    "stiffness_knm_per_rad -> stiffness": (
        "column stiffness: its unit is missing; write stiffness_nm_per_rad or"
    ),
    "stiffness_knm_per_rad -> stiffness_n_per_m": "stiffness, not torsional stiffness",
    "speed_ratio -> speed_ration": "column speed_ration: unknown; did you mean speed_ratio",
    "edge_kind -> name_of_edge": "there is no column edge_kind",
    "teeth_from,teeth_to -> teeth_to,teeth_to": "column teeth_to: there are two of it",
    "4,fan,0.2,0.5,,,,,,, -> 4,fan,0.2": "row 6: 3 cells under 11 column names",
    '4,fan,0.2 -> 4,"fan,0.2': "row 6: a double quote is open or out of place",
    "4,fan,0.2 -> 4,fan,1e300": "row 6 .*column inertia_kg_m2: 1e300 is beyond any machine",
}


@pytest.mark.parametrize(("change", "message"), LINE_REFUSED.items())
def test_a_mistake_in_the_line_names_row_and_column(line_of, change, message):
    with pytest.raises(ConfigError, match=message) as error:
        line_of(changed(SHAFTING, change))
    assert "\n" not in str(error.value)
    assert "line.csv" in str(error.value)


GEARS_REFUSED = {
    "3,wheel,40 -> 3,wheel,41": (
        r"line.csv, row 4 .*column teeth_to: 40, but on node 3 .* wheel with 41"
    ),
    "3,wheel,40 -> 9,wheel,40": (
        r"gears.csv, row 3 .*column node: .* has no node 9; the table has 1, 2, 3, 4$"
    ),
    "3,wheel,40,2 -> 3,wheel,40,3": (
        "edge_to: pinion and wheel cannot mesh: they have normal_module_mm 2 and 3; give"
    ),
    "3,wheel,40,2,20,0 -> 3,wheel,40,2,21,15": (
        "they have pressure_angle_deg 20 and 21, helix_angle_deg 0 and 15; give both"
    ),
    "3,wheel,40,2,20 -> 3,wheel,40,2,60": r"gears.csv, row 3 .*pressure_angle_deg = 60",
    "2,pinion,20 -> 2,pinion,3": r"gears.csv, row 2 .*undercut",
    "20,2,20,0,20 -> 20,2,20,0,-20": r"row 2 .*column face_width_mm: -20 must be positive",
    "20,2,20,0,20 -> 20,2,20,95,20": "helix angle below 90 degrees",
    "20,2,20,0,20 -> 20,0,20,0,20": "module must be positive",
    "20,2,20,0,20 -> 20,2,20,0,": "column face_width_mm: it is empty",
    "normal_module_mm -> normal_module": (
        "column normal_module: its unit is missing; write normal_module_mm or"
    ),
    "3,wheel -> 4,spare,40,2,20,0,20\n3,wheel": r"row 3 .*spare meshes with nothing",
    "3,wheel -> 3,twin,40,2,20,0,20\n3,wheel": "column teeth_to: node 3 has 2 such gears",
}


@pytest.mark.parametrize(("change", "message"), GEARS_REFUSED.items())
def test_a_mistake_in_the_gears_names_row_and_column(line_of, change, message):
    with pytest.raises(ConfigError, match=message) as error:
        line_of(gears=changed(GEARS, change))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("# only a note\n", "is empty"),
        ("node,name\n", "there is no column inertia_kg_m2"),
        (SHAFTING.splitlines()[1], "a header and no rows"),
    ],
)
def test_a_table_without_content_is_refused(line_of, text, message):
    with refused(message):
        line_of(text)


def test_gears_that_lock_are_named(line_of):
    ring = SHAFTING + ",,,,900,3,2,gear_mesh,39,19,\n"
    gears = GEARS + "3,second,39,2,20,0,20\n2,other,19,2,20,0,20\n"
    with refused(
        "row 7, column edge_to: this joint closes a loop that locks, pinion - wheel: it"
    ):
        line_of(ring, gears)


def test_a_loop_that_locks_names_its_nodes(line_of):
    shaft = SHAFTING + ",,,,20,4,1,shaft,,,\n"
    with pytest.raises(
        ConfigError, match=r"a loop that locks, .*: it would turn"
    ) as told:
        line_of(shaft)
    loop = str(told.value).split("locks, ")[1].split(":")[0].split(" - ")
    assert sorted(loop) == ["fan", "motor", "pinion", "wheel"]


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        (
            "10,1,2",
            "1e12,1,2",
            "motor - pinion with 1e.15 N m/rad and wheel - fan with",
        ),
        (
            "1500,2,3",
            "1e10,2,3",
            "pinion - wheel with 1e.13 N m/rad and motor - pinion",
        ),
        (
            "10,1,2",
            "1e-9,1,2",
            "pinion - wheel with 1.5e.06 N m/rad and motor - pinion",
        ),
    ],
)
def test_joints_that_rounding_cannot_tell_apart_are_named(line_of, old, new, named):
    """A unit that is wrong: records and forced vibration need the twist of every joint."""
    check_stiffness_range(line_of())
    with pytest.raises(ConfigError, match=f"edge_to: {named}.*too unlike.*1e.09"):
        check_stiffness_range(line_of(SHAFTING.replace(old, new)))


def test_an_inertia_that_rounding_hides_is_named(line_of):
    light = SHAFTING.replace("pinion,1e-3", "pinion,1e-12")
    stiff = light.replace("10,1,2", "1e5,1,2").replace("1500,2,3", "1e5,2,3")
    with pytest.raises(
        SimulationError, match=r"no restoring force beside pinion, .* at .*e.\d+ Hz"
    ):
        check_stiffness_range(line_of(stiff))


@pytest.mark.parametrize(
    ("keys", "message"),
    {
        "shafting_csv=None": (
            "system.shafting_csv is required: give system.shafting_csv=FILE and system.gears_csv"
        ),
        "shafting_csv='not_there.csv'": "not_there.csv cannot be read: No such file",
        "gears_csv=None": "node 3 has no gear to derive it from; give one, or system.gears_csv",
        "backlash_um=-1": "system.backlash_um = -1 must not be negative",
        "lateral=1": "system.lateral = 1 is not true or false",
        "loss_factor={'shaft':3,'coupling':0,'gear_mesh':0}": (
            "system.loss_factor.shaft = 3 must lie in 0..2"
        ),
        "loss_factor={'shaft':0}": "system.loss_factor: missing coupling, gear_mesh",
        "campbell={'low_speed_rpm':9,'high_speed_rpm':3,'orders':[1]}": (
            "low_speed_rpm must lie between"
        ),
        "campbell={'low_speed_rpm':0,'high_speed_rpm':3,'orders':[0]}": "all positive",
        "campbell={'low_speed_rpm':0,'high_speed_rpm':3,'orders':[]}": "all positive",
        "support=None": "system.support = None must be a group of keys",
        "latral=True": "system: unknown key 'latral'; did you mean 'lateral'",
    }.items(),
)
def test_a_mistake_in_the_keys_is_one_line(line_of, keys, message):
    with refused(message):
        line_of(**given(keys))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("force_n", 0),
        ("torque_nm", -1),
        ("torque_nm", None),
        ("damping_ratio", 1.5),
        ("bearing", 3),
        ("shaft", {}),
    ],
)
def test_a_mistake_in_the_supports_is_one_line(line_of, config, key, value):
    with refused(f"system.support.{key}"):
        line_of(support={**config["system"]["support"], key: value}, lateral=True)
