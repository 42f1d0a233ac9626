"""Trajectories as tables and labelled arrays: the same numbers under the names of the model."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from signorini.models import bouncing_ball
from signorini.runtime import export
from trap_models import rheonomic

Build = Callable[..., sg.Stepper]


@pytest.fixture
def ball(stepper: Build) -> sg.Trajectory:
    return stepper(bouncing_ball.model).simulate(t_end=0.6, dt=1e-2)


@pytest.fixture
def traps(stepper: Build) -> sg.Trajectory:
    """Rows of every kind; two slip components, inputs, an output."""
    u = np.linspace(0, 1, 60).reshape(30, 2)
    return stepper(rheonomic).simulate(t_end=0.3, dt=1e-2, inputs=u)


def test_a_table_has_every_column(traps: sg.Trajectory) -> None:
    table = traps.to_pandas()
    assert table.index.name == "t"
    np.testing.assert_array_equal(table.index, traps.t)
    np.testing.assert_array_equal(table["phi"], traps.q[:, 3])
    np.testing.assert_array_equal(table["u2"], traps.u[:, 1])
    np.testing.assert_array_equal(table["table.P_F[1]"], traps.P_F[:, 1])
    np.testing.assert_array_equal(table["height"], traps.outputs[:, 0])
    np.testing.assert_array_equal(table["energy"], traps.energy)
    assert table.attrs["parameters"] == traps.parameters
    assert set(table.columns) == set(export.columns(traps)) - {"t"}


def test_labelled_arrays(traps: sg.Trajectory, ball: sg.Trajectory) -> None:
    data = traps.to_xarray()
    assert dict(data.sizes) | {"t": 31, "coordinate": 5, "slip": 2, "gap": 1} == dict(data.sizes)
    np.testing.assert_array_equal(data.q.sel(coordinate="psi"), traps["psi"])
    np.testing.assert_array_equal(data.P_F.sel(slip="table[1]"), traps.P_F[:, 1])
    np.testing.assert_array_equal(data.P_g.sel(g_row="link"), traps["link.P_g"][:, 0])
    assert list(data.state.sel(contact="table").values) == list(traps["table.state"])
    assert data.t.attrs["units"] == "s"
    assert data.attrs["parameter om"] == 1.7
    assert "g_row" not in ball.to_xarray().sizes
    # the fall by label: y = 1 - g t^2 / 2
    y = float(ball.to_xarray().q.sel(coordinate="y").sel(t=0.231, method="nearest"))
    assert y == pytest.approx(1 - 9.81 / 2 * 0.23**2, abs=1e-12)


@pytest.mark.parametrize("ending", ["csv", "parquet", "nc"])
def test_files_read_back(ending: str, traps: sg.Trajectory, tmp_path: Path) -> None:
    pandas, xarray = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    path = traps.save(tmp_path / f"run.{ending}")
    if ending == "nc":
        with xarray.open_dataset(path, engine="h5netcdf") as data:
            np.testing.assert_array_equal(data.v.values, traps.v)
            assert list(data.state.values[:, 0]) == list(traps["table.state"])
            assert data.attrs["model"] == "rheonomic"
        return
    table = pandas.read_csv(path, index_col="t") if ending == "csv" else pandas.read_parquet(path)
    np.testing.assert_array_equal(table.index, traps.t)
    for name in ("phi_dot", "table.force_N", "roll.gamma", "energy"):
        values = table[name if name in table else f"{name}[0]"]
        np.testing.assert_array_equal(values, np.ravel(export.columns(traps)[values.name]))


def test_what_is_missing_is_named(
    ball: sg.Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(sg.RunError, match=r"needs the package 'pandas': .*signorini\[data\]"):
        ball.to_pandas()
    monkeypatch.setitem(__import__("sys").modules, "h5netcdf", None)
    with pytest.raises(sg.RunError, match="needs the package 'h5netcdf'"):
        ball.save(tmp_path / "run.nc")
    assert not list(tmp_path.iterdir())
    with pytest.raises(sg.RunError, match=r"use \.npz, \.csv, \.parquet, \.nc"):
        ball.save(tmp_path / "run.xlsx")
