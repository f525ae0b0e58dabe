"""Universal files of others: every form of data, axes, units, and files that are spoilt."""

import re
import warnings

import numpy as np
import pytest

from jaxmbs.errors import ModelError, ModelFileError
from jaxmbs.io import read_uff, write_uff
from jaxmbs.linear._transfer import TransferFunctions

pyuff = pytest.importorskip("pyuff")
F = np.array([1.0, 2.0, 3.5, 5.0, 8.0, 11.0, 14.0])
H = (1.0 + 0.25j) * F - 2.0


def text(
    x=F, values=H, form=6, spacing=0, axes=((18, "Hz"), (12, "NONE"), (13, "NONE")), places=((1, 3), (2, 1)), **own
):
    """One data set as the format describes it, its last line filled up with zeros."""
    parts = (np.real(values), np.imag(values)) if form > 4 else (np.real(values),)
    table = np.column_stack([*([] if spacing else [x]), *parts])
    single, row = form in (2, 5), {2: 6, 5: 6, 4: 4, 6: 4 if spacing else 3}[form]
    flat = list(table.ravel())
    flat += [0.0] * (-len(flat) % row)
    is_x = [not spacing and k % table.shape[1] == 0 for k in range(row)]
    cells = [f"{v:13.5E}" if single or is_x[k % row] else f"{v:20.12E}" for k, v in enumerate(flat)]
    count = own.get("count", len(values))
    ends = "".join(f" {'NONE':<10}{node:10d}{direction:4d}" for node, direction in places)
    lines = ["    -1", "    58", "made here", "NONE", "NONE", "NONE", "NONE"]
    lines += [f"{own.get('kind', 4):5d}{0:10d}{0:5d}{0:10d}{ends}"]
    step = x[1] - x[0] if spacing else 0.0
    lines += [f"{form:10d}{count:10d}{spacing:10d}{x[0] * spacing:13.5E}{step:13.5E}{0.0:13.5E}"]
    lines += [f"{code:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {unit:<20}" for code, unit in (*axes, (0, "NONE"))]
    lines += ["".join(cells[k : k + row]) for k in range(0, len(cells), row)]
    return "\n".join(f"{line:<80}" if k else line for k, line in enumerate(lines)) + "\n    -1\n"


def read(content, folder, **options):
    (folder / "a.uff").write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_uff(folder / "a.uff", **options)


def faults(content, folder, **options):
    with pytest.raises(ModelFileError) as told:
        read(content, folder, **options)
    return "\n".join(told.value.faults)


@pytest.mark.parametrize("spacing", [0, 1])
@pytest.mark.parametrize("form", [2, 4, 5, 6])
def test_forms_of_data(form, spacing, tmp_path):
    """Real and complex, single and double, even and uneven: the points that the header counts, no zeros behind."""
    x = np.arange(1.0, 8.0) if spacing else F
    values = H if form > 4 else H.real
    found = read(text(x, values, form, spacing), tmp_path)
    assert found.values.shape == (7, 1, 1) and found.kind == "accelerance" and found.inputs == ("2 x",)
    np.testing.assert_allclose(found.values[:, 0, 0], values, rtol=1e-5 if form in (2, 5) else 1e-12)
    np.testing.assert_allclose(found.omega, 2 * np.pi * x, rtol=1e-5)


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("spacing", [0, 1])
@pytest.mark.parametrize("is_complex", [True, False])
def test_what_pyuff_writes(binary, spacing, is_complex, tmp_path):
    sets = [
        pyuff.prepare_58(
            **dict(
                func_type=4, rsp_node=n, rsp_dir=1, ref_node=9, ref_dir=2, binary=binary, id1="a", id4="b", id5="c"
            ),
            **dict(x=np.arange(7.0), data=n * (H if is_complex else H.real), abscissa_spacing=spacing),
            **dict(ordinate_spec_data_type=8, orddenom_spec_data_type=13, abscissa_spec_data_type=18),
            **dict(abscissa_min=0.0, abscissa_inc=1.0, z_axis_spec_data_type=0),
        )
        for n in (1, 2)
    ]
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(sets, mode="add")
    found = read_uff(tmp_path / "a.uff")
    assert (found.outputs, found.kind) == (("1 x", "2 x"), "receptance")
    np.testing.assert_allclose(found.values[:, 1, 0], 2 * (H if is_complex else H.real), rtol=1e-12)
    np.testing.assert_allclose(found.omega, 2 * np.pi * np.arange(7.0))


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("form", [2, 4, 5, 6])
def test_binary_data_of_the_format(form, big, tmp_path):
    """Abscissae of single precision beside ordinates of either; bytes that look like the end of a data set."""
    word = (">" if big else "<") + ("f4" if form in (2, 5) else "f8")
    rows = np.zeros(7, [("x", word[0] + "f4"), ("y", word, (2 if form > 4 else 1,))])
    rows["x"], rows["y"] = F, np.column_stack([H.real, H.imag])[:, : 2 if form > 4 else 1]
    content = rows.tobytes()
    head = text(form=form).encode().splitlines(True)
    head[1] = f"    58b{1 + big:6d}{2:6d}{11:12d}{len(content):12d}{0:6d}{0:6d}{0:12d}{0:12d}\n".encode()
    found = read(b"".join(head[:13]) + content + b"    -1\n" + text(places=((7, 3), (2, 1))).encode(), tmp_path)
    assert found.outputs == ("1 z", "7 z")
    np.testing.assert_allclose(found.values[:, 0, 0], H if form > 4 else H.real, rtol=1e-6)


G, LBF = 9.80665, 4.4482216152605
MM = f"    -1\n   164\n{5:10d}{'mm (milli newton)':>20}{2:10d}\n{1e3:25.17E}{1e3:25.17E}{1.0:25.17E}\n    -1\n"
UNITS = [
    ((18, "Hz"), (12, "g"), (13, "N"), "accelerance", G),
    ((18, "Hz"), (12, "m/s^2"), (13, "kN"), "accelerance", 1e-3),
    ((18, "NONE"), (8, "mm"), (13, "N"), "receptance", 1e-3),
    ((18, "NONE"), (11, "in/s"), (13, "lbf"), "mobility", 0.0254 / LBF),
    ((18, "NONE"), (0, "(m/s²)/N"), (0, "NONE"), "accelerance", 1.0),
    ((18, "NONE"), (0, "m/s2"), (13, "NONE"), "accelerance", 1.0),
    ((18, "NONE"), (12, "g/lbf"), (13, "NONE"), "accelerance", G / LBF),
    ((0, "Hz"), (12, "m/sec**2"), (9, "N"), "accelerance", 1.0),
]


@pytest.mark.parametrize("case", UNITS, ids=str)
def test_units_of_labels(case, tmp_path):
    *axes, kind, size = case
    found = read(text(axes=axes), tmp_path)
    assert found.kind == kind
    np.testing.assert_allclose(found.values[:, 0, 0], size * H, rtol=1e-11)
    np.testing.assert_allclose(found.omega, 2 * np.pi * F, rtol=1e-5)


def test_units_of_the_file_and_of_rotations(tmp_path):
    """Data set 164 counts where labels are silent; a rotation has no length, a moment has one more."""
    axes, per_force = ((18, "NONE"), (8, "NONE"), (13, "NONE")), 1e-3
    for places, size in (
        (((1, 3), (2, 1)), 1e-3 / per_force),
        (((1, -4), (2, 1)), 1 / per_force),
        (((1, 3), (2, 5)), 1e-3 / (per_force * 1e-3)),
        (((1, 5), (2, 5)), 1 / (per_force * 1e-3)),
    ):
        np.testing.assert_allclose(read(MM + text(axes=axes, places=places), tmp_path).values[:, 0, 0], size * H)
    labelled = text(axes=((18, "rad/s"), (8, "deg"), (13, "N m")), places=((1, 4), (2, 6)))
    found = read(MM + labelled, tmp_path)
    np.testing.assert_allclose(found.values[:, 0, 0], np.pi / 180 * H)
    np.testing.assert_allclose(found.omega, F, rtol=1e-5)


REFUSED = {
    "no displacement, velocity or acceleration": ((18, ""), (3, ""), (13, "")),
    "its ordinate is stress": ((18, ""), (2, ""), (13, "")),
    "its ordinate is unknown: kind=": ((18, ""), (0, ""), (13, "")),
    "its ordinate is general: kind=": ((18, ""), (1, ""), (13, "")),
    "its denominator is acceleration, no force": ((18, ""), (12, ""), (12, "")),
    "its denominator is unknown": ((18, ""), (12, ""), (0, "")),
    "its abscissa is of the type time": ((17, ""), (12, ""), (13, "")),
    "its abscissa is of an unknown type": ((0, ""), (12, ""), (13, "")),
    "its frequencies are in 'furlong'": ((18, "furlong"), (12, ""), (13, "")),
    "in 'V', which is no unit of displacement": ((18, ""), (12, "V"), (13, "")),
    "in 'V', which is no unit of force": ((18, ""), (12, ""), (13, "V")),
    "said to be accelerance and receptance": ((18, ""), (8, "m/s^2"), (13, "")),
    "its ordinate is per 'n', its denominator in 'lbf'": ((18, ""), (12, "m/s^2/N"), (13, "lbf")),
}


@pytest.mark.parametrize("message", REFUSED)
def test_axes_that_are_no_transfer_function(message, tmp_path):
    assert message in faults(text(axes=REFUSED[message]), tmp_path)


def test_what_the_user_says_of_unknown_axes(tmp_path):
    unknown = text(axes=((0, ""), (0, ""), (0, "")))
    assert read(unknown, tmp_path, kind="mobility").kind == "mobility"
    assert "said to be" in faults(text(), tmp_path, kind="mobility")
    assert "no displacement" in faults(text(axes=((18, ""), (3, ""), (13, ""))), tmp_path, kind="mobility")
    with pytest.raises(ValueError, match="is none of"):
        read(unknown, tmp_path, kind="speed")


def lines(content):
    return content.splitlines(True)


SPOILT = {
    "header says 21 numbers, it has 18: it is cut off": lambda s: "".join([*lines(s)[:-2], lines(s)[-1]]),
    "has no end: the file is cut off": lambda s: "".join(lines(s)[:-1]),
    "outside of a data set": lambda s: "".join(lines(s)[:-1]) + text(places=((5, 1), (2, 1))),
    "its header says 15 numbers, it has 21": lambda s: text(count=5),
    "'nan' is not a number|not finite": lambda s: s.replace("5.000000000000E-01", "               nan"),
    "'here' is not a number": lambda s: s.replace("5.000000000000E-01", "              here"),
    "its frequencies do not ascend": lambda s: text(F[::-1]),
    "1 z by 2 x stands 2 times": lambda s: s + s,
    "5 x by 2 x is at other frequencies": lambda s: s + text(1.5 * F, places=((5, 1), (2, 1))),
    "of another kind than the first": lambda s: s + text(axes=((18, ""), (8, ""), (13, "")), places=((5, 1), (2, 1))),
    "a direction is none of -6 to 6": lambda s: text(places=((1, 7), (2, 1))),
    "magnitudes, without their phases": lambda s: text(values=np.abs(H), form=4),
    "none of the format's": lambda s: text(form=6).replace(f"{6:10d}{7:10d}", f"{3:10d}{7:10d}"),
    "it has 1 x coherence": lambda s: text(kind=6),
    "is no number of a data set": lambda s: s.replace("    58", "  rest", 1),
    "header of 11 lines is cut off": lambda s: "".join(lines(s)[:9]) + "    -1\n",
    "it has no transfer functions": lambda s: "",
}


@pytest.mark.parametrize("message", SPOILT)
def test_spoilt_files(message, tmp_path):
    spoilt = SPOILT[message](text())
    assert spoilt != text()
    assert re.search(message, faults(spoilt, tmp_path))


def test_what_is_left_out_is_said(tmp_path):
    others = text(kind=6) + text(kind=2) + "    -1\n    15\n         1         0         0        11\n    -1\n"
    with pytest.warns(UserWarning, match="left out: 1 x coherence, 1 x auto spectrum, 1 x data set 15"):
        assert read(text() + others, tmp_path).outputs == ("1 z",)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(MM + text(), tmp_path)


@pytest.mark.parametrize(
    "content", [b"\x00" * 500, b"\xff\xfe garbage \n" * 9, b"    -1\n", b"    -1\n    58\n    -1\n"]
)
def test_garbage(content, tmp_path):
    assert faults(content, tmp_path)
    with pytest.raises(ModelFileError, match="No such file"):
        read_uff(tmp_path / "none.uff")


@pytest.mark.slow
def test_a_thousand_changed_bytes(tmp_path):
    """The same numbers, others that stand in the file, or an error of ours."""
    random, good, count = np.random.default_rng(0), bytearray(text().encode()), 0
    for _ in range(1000):
        content = bytearray(good)
        at = random.integers(0, len(content))
        content[at : at + random.integers(1, 30)] = random.bytes(random.integers(0, 3))
        try:
            read(bytes(content), tmp_path)
        except ModelError:
            count += 1
    assert count > 200


def test_numbers_that_cannot_be_written(tmp_path):
    values = np.array([[[1.0, np.nan]], [[2.0, np.inf]]], complex)
    sent = TransferFunctions([1.0, 2.0], values, ["a"], ["b", "c"])
    with pytest.raises(ModelError, match="a by c is not finite at 2 frequencies"):
        write_uff(tmp_path / "a.uff", sent)
    assert not list(tmp_path.iterdir())
    with pytest.raises(ModelError, match="not ascend in the six digits"):
        write_uff(tmp_path / "a.uff", TransferFunctions([1.0, 1.0 + 1e-9], np.ones((2, 1, 1)), ["a"], ["b"]))
    with pytest.raises(ModelError, match="characters that are not printed"):
        write_uff(tmp_path / "a.uff", TransferFunctions([1.0], np.ones((1, 1, 1)), ["a\nb"], ["b"]))
