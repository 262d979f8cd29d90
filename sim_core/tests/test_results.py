# SPDX-License-Identifier: Apache-2.0
"""What a run leaves, and what is read back from the files and pictures made of it."""

import xml.etree.ElementTree as ElementTree

import matplotlib
import meshio
import numpy as np
import pytest
import xarray
from matplotlib import pyplot
from matplotlib.collections import LineCollection, PolyCollection
from PIL import Image

import sim_core as sc

matplotlib.use("agg")


@pytest.fixture(scope="module")
def result(nit_model):
    """A tow with fins, its fish off the middle line: a tow point that moves sideways too."""
    model = nit_model()
    motion = sc.Sinusoid(mean=(0, 0, 0.2), velocity=(1, 0.5, 0), amplitude=0.06, period=1)
    return sc.run(model, motion, t_end=0.5, output_step=0.1)


def test_names_and_shapes(result):
    assert set(result.points) == {"tow_point", "junction", "depressor"}
    assert list(result.bodies) == ["fish"]
    assert result.time == pytest.approx(np.arange(6) * 0.1, abs=1e-12)
    for name, segments in (("primary", 10), ("depressor_cable", 3), ("secondary", 7)):
        line = result.lines[name]
        assert line.node_positions.shape == line.node_velocities.shape == (6, segments + 1, 3)
        assert line.tensions.shape == (6, segments)
    ends = result.lines["secondary"]
    assert np.array_equal(ends.node_velocities[:, 0], result.points["junction"].velocity)
    towed_at = result.bodies["fish"].position_of((0.65, 0, 0))
    assert ends.node_positions[:, -1] == pytest.approx(towed_at, abs=1e-12)
    assert result.model.lines == list(result.lines)


# ------------------------------------------------------------------------------------ NetCDF


def test_netcdf_reads_back_with_names_and_units(result, tmp_path):
    path = tmp_path / "tow.nc"
    result.to_netcdf(path)
    with xarray.open_dataset(path, engine="h5netcdf") as tow:
        assert tow.Conventions.startswith("CF-")
        assert tow.time.units == "s"
        assert tow.time.values.tolist() == result.time.tolist()
        depressor = tow.point_position.sel(point="depressor", axis="z")
        assert depressor.values.tolist() == result.points["depressor"].position[:, 2].tolist()
        assert depressor.units == "m"
        fish = tow.body_quaternion.sel(body="fish", component="w")
        assert fish.values.tolist() == result.bodies["fish"].quaternion[:, 0].tolist()
        tension = tow.tension_secondary
        assert tension.values.tolist() == result.lines["secondary"].tensions.tolist()
        assert (tension.dims, tension.units) == (("time", "segment_secondary"), "N")
        assert tow.arc_length_primary.values == pytest.approx(np.arange(11) * 0.12, abs=1e-12)
        for variable in tow.data_vars.values():
            assert variable.attrs["units"] and variable.attrs["long_name"]


@pytest.fixture(scope="module")
def bent():
    """A stiff cable, clamped upright at a hook that moves, and a limp one on the same hook."""
    stiff = sc.LineProperties(
        length=2.0,
        diameter=0.01,
        mass_per_length=0.2,
        axial_stiffness=1e5,
        bending_stiffness=3.0,
    )
    rig = sc.System(
        points={
            "hook": sc.PrescribedPoint(),
            "a": sc.FreePoint(mass=2.0),
            "b": sc.FreePoint(mass=3.0),
        },
        lines={
            "limp": sc.Line("hook", "a", stiff.replace(bending_stiffness=0.0), segments=3),
            "stiff": sc.Line("hook", "b", stiff, segments=5, start_direction=(0, 0, -1)),
        },
    )
    motion = sc.SteadyTow(position=(0, 0, -1), velocity=(1, 0, 0))
    return sc.run(rig.build(), motion, t_end=0.2, output_step=0.1)


def test_loads_are_in_the_netcdf_file(bent, tmp_path):
    path = tmp_path / "bent.nc"
    bent.to_netcdf(path)
    stiff = bent.lines["stiff"]
    with xarray.open_dataset(path, engine="h5netcdf") as tow:
        load = tow.hook_load.sel(prescribed_point="hook")
        assert load.values.tolist() == bent.points["hook"].hook_load.tolist()
        assert (load.dims, load.units) == (("time", "axis"), "N")
        assert tow.start_tension_limp.values.tolist() == bent.lines["limp"].start_tension.tolist()
        assert tow.end_tension_stiff.values.tolist() == stiff.end_tension.tolist()
        assert tow.bending_moment_stiff.values.tolist() == stiff.bending_moments.tolist()
        assert tow.bending_moment_stiff.dims == ("time", "node_stiff")
        assert tow.curvature_stiff.values.tolist() == stiff.curvatures.tolist()
        assert tow.curvature_stiff.units == "m-1"
        assert "curvature_limp" not in tow


def test_loads_are_in_the_vtk_files(bent, tmp_path):
    bent.to_vtk(tmp_path / "vtk")
    points = meshio.read(tmp_path / "vtk" / "points_000001.vtu")
    hook = list(bent.points).index("hook")
    assert points.point_data["hook load [N]"][hook].tolist() == (
        bent.points["hook"].hook_load[1].tolist()
    )
    lines = meshio.read(tmp_path / "vtk" / "lines_000001.vtu")
    for name, quantity in (
        ("bending moment [N m]", "bending_moments"),
        ("curvature [1/m]", "curvatures"),
    ):
        expected = [0.0] * 4 + getattr(bent.lines["stiff"], quantity)[1].tolist()
        assert lines.point_data[name].tolist() == expected


def test_a_file_is_not_overwritten(result, tmp_path):
    path = tmp_path / "tow.nc"
    path.write_text("precious")
    with pytest.raises(FileExistsError, match=r"tow\.nc"):
        result.to_netcdf(path)
    assert path.read_text() == "precious"


def test_points_alone_make_a_dataset_too(free_sphere):
    model = free_sphere(1.0, 1e-3, 0.01, 0.5)
    state = sc.State(model)
    state.set_point("far", (0, 0, 999.0))
    run = sc.run(model, sc.SteadyTow(position=(0, 0, 999.0)), state=state, t_end=0.02)
    expected = {"time", "point", "prescribed_point", "axis", "node_thread", "segment_thread"}
    assert set(run.to_xarray().dims) == expected


# --------------------------------------------------------------------------------------- VTK


def test_vtk_reads_back_as_a_time_series(result, tmp_path):
    index = result.to_vtk(tmp_path / "vtk", every=2)
    listed = ElementTree.parse(index).getroot().findall("Collection/DataSet")
    assert len(listed) == 3 * 3
    assert {float(entry.get("timestep")) for entry in listed} == set(result.time[::2])
    files = {
        entry.get("name"): index.parent / entry.get("file")
        for entry in listed
        if float(entry.get("timestep")) == result.time[4]
    }
    lines = meshio.read(files["lines"])
    secondary = lines.cell_data["line"][0] == 2
    assert np.array_equal(
        lines.cell_data["tension [N]"][0][secondary], result.lines["secondary"].tensions[4]
    )
    nodes = lines.points[lines.cells[0].data[secondary]]
    assert np.array_equal(nodes[:, 0], result.lines["secondary"].node_positions[4, :-1])
    assert np.array_equal(nodes[:, 1], result.lines["secondary"].node_positions[4, 1:])
    points = meshio.read(files["points"])
    for i, point in enumerate(result.points.values()):
        assert np.array_equal(points.points[i], point.position[4])
        assert np.array_equal(points.point_data["velocity [m/s]"][i], point.velocity[4])


def test_vtk_shows_the_hull_where_the_body_is(result, tmp_path):
    result.to_vtk(tmp_path / "vtk")
    bodies = meshio.read(tmp_path / "vtk" / "bodies_000003.vtu")
    fish = result.bodies["fish"]
    quaternion = fish.quaternion[3]
    forward = bodies.cell_data["forward"][0][0]
    nose = fish.position_of((0.65, 0, 0))[3]
    assert forward * 0.65 == pytest.approx(nose - fish.position[3], abs=1e-12)
    # The hull has 2 × 16 corners, on circles of its radius about both ends of its axis.
    ends = bodies.points[16:32]
    assert ends.mean(axis=0) == pytest.approx(nose, abs=1e-12)
    assert np.linalg.norm(ends - nose, axis=1) == pytest.approx(0.055, rel=1e-12)
    # Four fins of 0.012 m² follow, square: the sides of each are √0.012 m.
    quads = bodies.points[bodies.cells[0].data[-4:]]
    sides = np.linalg.norm(quads - np.roll(quads, 1, axis=1), axis=2)
    assert sides == pytest.approx(np.sqrt(0.012), rel=1e-12)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12)


def test_vtk_goes_to_a_directory_of_its_own(result, tmp_path):
    (tmp_path / "data.txt").write_text("precious")
    with pytest.raises(FileExistsError, match="choose another directory"):
        result.to_vtk(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["data.txt"]
    with pytest.raises(ValueError, match="every is 0"):
        result.to_vtk(tmp_path / "vtk", every=0)


# ---------------------------------------------------------------------------------- pictures


@pytest.fixture
def close_figures():
    yield
    pyplot.close("all")


def test_plot_of_hook_loads_shows_their_components(bent, close_figures):
    ax = sc.plot_loads(bent)
    curves = {curve.get_label(): curve for curve in ax.get_lines()}
    load = bent.points["hook"].hook_load
    assert curves["hook z"].get_xdata().tolist() == bent.time.tolist()
    for axis, name in enumerate("xyz"):
        assert curves[f"hook {name}"].get_ydata().tolist() == load[:, axis].tolist()
    assert curves["limp, start"].get_ydata().tolist() == bent.lines["limp"].start_tension.tolist()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time (s)", "force (N)")


def test_plot_of_bending_shows_moment_and_curvature_along_the_line(bent, close_figures):
    moment, curvature = sc.plot_bending(bent, "stiff", 0.1)
    stiff = bent.lines["stiff"]
    drawn, largest = moment.get_lines()
    assert drawn.get_xdata() == pytest.approx(np.linspace(0.0, 2.0, 6), abs=1e-12)
    assert drawn.get_ydata().tolist() == stiff.bending_moments[1].tolist()
    assert largest.get_ydata().tolist() == stiff.bending_moments.max(axis=0).tolist()
    assert curvature.get_lines()[0].get_ydata().tolist() == stiff.curvatures[1].tolist()
    assert moment.get_ylabel() == "bending moment (N m)"
    assert curvature.get_ylabel() == "curvature (1/m)"
    with pytest.raises(ValueError, match="line 'limp' has no bending stiffness"):
        sc.plot_bending(bent, "limp")


@pytest.mark.parametrize(("view", "axes"), [("side", "xz"), ("top", "xy"), ("front", "yz")])
def test_shape_is_drawn_to_scale_with_its_tension(result, view, axes, close_figures):
    ax = sc.plot_shape(result, 0.3, view=view)
    ax.figure.canvas.draw()
    shown = ["xyz".index(axis) for axis in axes]
    lines = next(c for c in ax.collections if isinstance(c, LineCollection))
    primary = result.lines["primary"].node_positions[3][:, shown]
    assert np.array_equal([s[0] for s in lines.get_segments()[:10]], primary[:-1])
    assert lines.get_array()[:10].tolist() == result.lines["primary"].tensions[3].tolist()
    hull = next(c for c in ax.collections if isinstance(c, PolyCollection))
    corners = np.concatenate([path.vertices for path in hull.get_paths()])
    fish = result.bodies["fish"].position[3][shown]
    assert np.linalg.norm(corners - fish, axis=1).max() < 0.7, "half the hull and some"
    assert (ax.get_xlabel(), ax.get_ylabel()) == tuple(f"{axis} (m)" for axis in axes)
    assert ax.get_title() == "t = 0.30 s"
    scale = ax.transData.transform([(0, 0), (1, 1)])
    assert np.ptp(scale[:, 0]) == pytest.approx(np.ptp(scale[:, 1]), rel=1e-9)
    for low, high, all_of in zip(
        (ax.get_xlim()[0], ax.get_ylim()[0]),
        (ax.get_xlim()[1], ax.get_ylim()[1]),
        np.concatenate([primary, corners]).T,
        strict=True,
    ):
        assert low < all_of.min() and all_of.max() < high


def test_a_time_outside_the_run_is_refused(result):
    with pytest.raises(ValueError, match=r"time 7 s is outside the run, 0 to 0\.5 s"):
        sc.plot_shape(result, 7.0)


def test_animation_has_a_frame_for_each_instant(result, tmp_path, close_figures):
    path = tmp_path / "tow.gif"
    sc.animate(result, path, frame_rate=5)
    with Image.open(path) as film:
        # 0, 0.2 and 0.4 s
        assert (film.format, film.n_frames, film.info["duration"]) == ("GIF", 3, 200)
    before = path.read_bytes()
    with pytest.raises(FileExistsError, match=r"tow\.gif"):
        sc.animate(result, path)
    assert path.read_bytes() == before
    with pytest.raises(ValueError, match=r"saved as \.gif or \.html"):
        sc.animate(result, tmp_path / "tow.avi")
