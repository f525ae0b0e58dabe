"""Hostile URDF, MJCF and model files: a model or our own error, nothing read outside, no memory eaten."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import jaxmbs as mbs
from tests.adversary.hostile import judged, tried
from tests.io.texts import ARM_URDF, BENCH_MJCF

BOMB = "<!DOCTYPE a [<!ENTITY b 'bbbbbbbbbb'><!ENTITY c '&b;&b;&b;&b;&b;&b;&b;&b;'>]>"
READERS = {".urdf": mbs.io.read_urdf, ".sdf": mbs.io.read_sdf, ".xml": mbs.io.read_mjcf, ".json": mbs.load_model}


def refused(file, content, reason="fault"):
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(mbs.ModelFileError, match=reason):
        READERS[file.suffix](file)


@pytest.mark.long
def test_mutated_files(tmp_path):
    assert sum(tried(300, 1, tmp_path).values()) == 300


@pytest.mark.long
def test_two_thousand_mutated_files(tmp_path):
    found = tried(2000, 2, tmp_path)
    assert {kind for _, kind in found} == {"model", "refused"}


@pytest.mark.long
def test_twenty_thousand_mutated_files(tmp_path):
    """In a process of their own, as a crash would be one of MuJoCo's parser."""
    code = (
        "import sys, pathlib; from tests.adversary.hostile import tried; tried(20000, 3, pathlib.Path(sys.argv[1]))"
    )
    root = Path(__file__).parent.parent.parent
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.long
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)))
def test_any_bytes(tmp_path, content):
    for ending, read in READERS.items():
        file = tmp_path / f"any{ending}"
        file.write_bytes(content)
        assert judged(file, read) == "refused"


JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(
            st.sampled_from(["type", "function", "mapping", "bodies", "mass", "axis", "real", "imag"]), inner
        ),
    ),
    max_leaves=20,
)


@pytest.mark.long
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(model=JSON, kind=st.sampled_from(["SystemBuilder", "Table", "Coupler", "Structure", "Limit", "Pose", None]))
def test_any_json(tmp_path, model, kind):
    if isinstance(model, dict) and kind is not None:
        model["type"] = kind
    file = tmp_path / "any.json"
    file.write_text(json.dumps({"jaxmbs model": 1, "model": model}))
    assert judged(file, mbs.load_model) in ("model", "refused")


@pytest.mark.parametrize("ending", READERS)
def test_shapes_of_files(ending, tmp_path):
    file = tmp_path / f"bad{ending}"
    refused(file, b"")
    refused(file, b"\xff\xfe<\x00r\x00")
    refused(file, b"\x00" * 1000)
    with pytest.raises(mbs.ModelFileError, match="cannot be read"):
        READERS[ending](tmp_path)
    with pytest.raises(mbs.ModelFileError, match="cannot be read"):
        READERS[ending](tmp_path / f"a\0b{ending}")


def test_entities_and_depth(tmp_path):
    for text, ending in ((ARM_URDF, ".urdf"), (BENCH_MJCF, ".xml")):
        file = tmp_path / f"bad{ending}"
        root = "<robot" if ending == ".urdf" else "<mujoco"
        refused(file, text.replace(root, BOMB + root, 1), "document type or entities")
        refused(file, text.replace(root, "<!doctype x>" + root, 1), "document type or entities|well-formed")
        tag = "link" if ending == ".urdf" else "body"
        refused(file, f"{root}>{f'<{tag}>' * 100_000}", "well-formed|nested")
        refused(file, f"{root}>{f'<{tag}>' * 300}{f'</{tag}>' * 300}</{root[1:]}>", "nested more than 200 deep")
    refused(tmp_path / "bad.json", "[" * 100_000, "not readable JSON")
    refused(tmp_path / "bad.json", '{"jaxmbs model": 1, "model": %s}' % ("[" * 900 + "]" * 900), "nested|no|JSON")


def test_sizes(tmp_path):
    file = tmp_path / "large.urdf"
    with open(file, "wb") as handle:
        handle.truncate(40_000_000)
    with pytest.raises(mbs.ModelFileError, match="more than 32 megabytes"):
        mbs.io.read_urdf(file)
    refused(tmp_path / "many.xml", f"<mujoco>{'<a/>' * 200_000}</mujoco>", "more than 200000 elements")


def test_nothing_outside_the_folder_is_read(tmp_path, monkeypatch):
    inner, secret = tmp_path / "model", tmp_path / "secret.xml"
    inner.mkdir()
    secret.write_text("<mujocoinclude><worldbody/></mujocoinclude>")
    (inner / "link.xml").symlink_to(secret)
    opened, real = [], open

    def watched(file, *args, **options):
        opened.append(os.fspath(file))
        return real(file, *args, **options)

    monkeypatch.setattr("builtins.open", watched)
    for name in ("../secret.xml", str(secret), "link.xml", "x/../../secret.xml", "\0"[:0], "~/secret.xml"):
        refused(inner / "main.xml", f"<mujoco><include file='{name}'/></mujoco>", "no such file inside")
    mesh = "<mujoco><asset><mesh name='m' file='%s'/></asset><worldbody><body><joint/><geom type='mesh' mesh='m'/>"
    mesh += "</body></worldbody></mujoco>"
    for name in ("../secret.xml", str(secret), "link.xml"):
        refused(inner / "main.xml", mesh % name, "not in the folder")
    assert not [name for name in opened if Path(name).name in ("secret.xml", "link.xml")]
    refused(inner / "main.xml", "<mujoco><include file='main.xml'/></mujoco>", "too deep|too many|themselves")


def test_other_files_are_never_named_to_mujoco(tmp_path):
    body = "<worldbody><body><joint/><geom size='1'/></body></worldbody>"
    file = tmp_path / "main.xml"
    file.write_text(
        "<mujoco><asset><texture name='t' type='2d' file='/etc/passwd'/>"
        "<hfield name='h' file='/etc/passwd' size='1 1 1 1'/>"
        f"<material name='m' texture='t'/><skin file='/etc/passwd'/></asset>{body}</mujoco>"
    )
    assert mbs.io.read_mjcf(file).builder.faults() == []
    refused(file, f"<mujoco><asset><model name='m' file='other.xml'/></asset>{body}</mujoco>", "attached models")
    outside = body.replace("<geom", "<site file='/etc/passwd'/><geom")
    refused(file, f"<mujoco>{outside}</mujoco>", "reads the file")
