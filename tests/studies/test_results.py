"""Results as tables of pandas and datasets of xarray, with names and units."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.linear import TransferFunctions

pytest.importorskip("xarray")


@pytest.fixture(scope="module")
def swinging():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("arm", mass=2.0, com=(0.0, 0.0, -0.5), inertia=(0.1, 0.1, 0.1))
    b.body("ball", mass=1.0, com=(0.0, 0.0, -0.2), inertia=(0.1, 0.1, 0.1))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.joint("socket", mbs.Spherical(), "arm", "ball", parent_frame=(0.0, 0.0, -1.0))
    b.force("spring", mbs.SpringDamper(stiffness=20.0), joint="pin")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system, pin=0.3), ts=np.linspace(0.0, 0.2, 3))
    return system, motion, mbs.reactions(system, motion)


@pytest.mark.long
def test_motion(swinging, tmp_path):
    system, motion, _ = swinging
    found = motion.to_xarray()
    np.testing.assert_array_equal(
        found["coordinates"].sel(coordinate="pin"), system.coordinates(motion.states)["pin"]
    )
    spin = found["velocities"].sel(velocity=["socket rx", "socket ry", "socket rz"])
    np.testing.assert_array_equal(spin, system.velocities(motion.states)["socket"])
    assert found["time"].attrs["units"] == "s" and found["kinetic"].attrs["units"] == "J"
    assert found["work"].dims == ("time", "element") and found.attrs["status"] == "success"
    frame = motion.to_pandas()
    np.testing.assert_array_equal(frame["pin"], found["coordinates"].sel(coordinate="pin"))
    np.testing.assert_array_equal(frame["velocity of pin"], system.velocities(motion.states)["pin"])
    assert frame.index.name == "time" and list(frame.columns[-2:]) == ["kinetic", "potential"]
    frame.to_csv(tmp_path / "motion.csv")
    assert (tmp_path / "motion.csv").read_text().startswith("time,pin,socket w")


@pytest.mark.long
def test_files(swinging, tmp_path):
    """NetCDF and Parquet give back what was written."""
    xarray, pandas = pytest.importorskip("xarray"), pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    _, motion, loads = swinging
    for name, found in {"motion": motion.to_xarray(), "loads": loads.to_xarray(motion.ts)}.items():
        found.to_netcdf(tmp_path / f"{name}.nc")
        with xarray.open_dataset(tmp_path / f"{name}.nc") as again:
            xarray.testing.assert_equal(again.astype({v: found[v].dtype for v in found}), found)
    for name, frame in {"motion": motion.to_pandas(), "loads": loads.to_pandas(motion.ts)}.items():
        frame.to_parquet(tmp_path / f"{name}.parquet")
        pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / f"{name}.parquet"), frame)


@pytest.mark.long
def test_reactions(swinging):
    _, motion, loads = swinging
    found = loads.to_xarray(motion.ts)
    np.testing.assert_array_equal(found["force"].sel(joint="pin"), loads["pin"].force)
    np.testing.assert_array_equal(found["moment"].sel(joint="socket", component="y"), loads["socket"].moment[:, 1])
    assert found["force"].attrs["units"] == "N" and bool(found["unique_force"].all())
    frame = loads.to_pandas()
    np.testing.assert_array_equal(frame.xs("pin", level="joint").index, motion.ts)
    np.testing.assert_array_equal(frame.xs("pin", level="joint")["effort 0"], loads["pin"].effort[:, 0])
    np.testing.assert_array_equal(frame.xs("socket", level="joint")["effort 2"], loads["socket"].effort[:, 2])
    assert frame.xs("pin", level="joint")["effort 1"].isna().all()
    with pytest.raises(ValueError, match="instants"):
        loads.to_pandas(motion.ts[:-1])
    np.testing.assert_array_equal(frame.xs("pin", level="joint")["force z"], loads["pin"].force[:, 2])
    np.testing.assert_array_equal(frame.xs("socket", level="joint")["moment x"], loads["socket"].moment[:, 0])


def test_modes_and_transfer_functions():
    system = mbs.LinearSystem(
        mass=jnp.eye(2), stiffness=jnp.array([[3.0, -1.0], [-1.0, 3.0]]), coordinates=("a", "b")
    )
    modes = mbs.modes(system)
    found = modes.to_xarray(system.coordinates)
    np.testing.assert_allclose(found["frequency"], np.sqrt([2.0, 4.0]) / (2.0 * np.pi))
    np.testing.assert_array_equal(found["shape"].sel(coordinate="b"), modes.shapes[1])
    np.testing.assert_array_equal(modes.to_pandas()["frequency"], modes.frequencies)

    values = np.arange(12).reshape(2, 3, 2) * (1 + 1j)
    measured = TransferFunctions(np.array([1.0, 2.0]), values, ["x", "y", "z"], ["p", "q"], "mobility")
    table = measured.to_xarray()
    assert table.name == "mobility" and complex(table.sel(output="y", input="q")[1]) == values[1, 1, 1]
    np.testing.assert_allclose(table["frequency"], np.array([1.0, 2.0]) / (2.0 * np.pi))
    np.testing.assert_array_equal(measured.to_pandas()["z", "p"], values[:, 2, 0])


def test_optimum():
    limit = mbs.Limit("sum", lambda d: d["x"][0] + d["x"][1], upper=1.0)
    best = mbs.minimise(
        lambda d: jnp.sum((d["x"] - 1.0) ** 2), {"x": np.zeros(2)}, {"x": (-1.0, 2.0)}, limits=[limit], progress=False
    )
    frame = best.to_pandas()
    np.testing.assert_allclose(frame.loc["x[1]"], [0.0, 0.5, -1.0, 2.0], atol=1e-6)
    limits = best.limits_to_pandas()
    assert bool(limits.loc["sum", "active"]) and limits.loc["sum", "price"] == pytest.approx(-1.0, rel=1e-4)
    found = best.to_xarray()
    assert float(found["after"].sel(variable="x[0]")) == pytest.approx(0.5, abs=1e-6)
    assert found.attrs["reason"] == "converged" and float(found["limit bound"].sel(limit="sum")) == 1.0
