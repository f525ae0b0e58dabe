"""Spoilt decks and meshes: a model or an error of ours, nothing else; thousands of them."""

from pathlib import Path

import pytest

from jaxmbs.errors import ModelError
from jaxmbs.io import read_mesh, read_nastran
from tests.adversary.mutate import outcomes
from tests.io.zoo_of_cards import ZOO

MSH4 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "edge"
2 2 "skin"
$EndPhysicalNames
$Entities
0 1 1 0
1 0 0 0 1 0 0 1 1 0
1 0 0 0 1 1 0 1 2 0
$EndEntities
$Nodes
1 4 1 4
2 1 0 4
1
2
3
4
0 0 0
1 0 0
1 1 0
0 1 0
$EndNodes
$Elements
2 2 1 2
1 1 1 1
1 1 2
2 1 3 1
2 1 2 3 4
$EndElements
"""
MSH2 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "edge"
2 2 "skin"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
3
1 1 2 1 1 1 2
2 2 2 2 1 1 2 3
3 2 2 2 1 1 3 4
$EndElements
"""

CHAIN = "".join(f"CORD2R,{k},{k + 1},,,,,,1.\n,1.\n" for k in range(1, 1000))
ROD = "GRID,1\nGRID,2,,1.,,\nMAT1,1,1.,,.3\nPROD,1,1,1.\nCROD,1,1,1,2\n"

READERS = {
    "decks": (lambda: [text.encode() for text in ZOO.values()], read_nastran, "deck.bdf"),
    "meshes": (lambda: [MSH4.encode(), MSH2.encode()], read_mesh, "mesh.msh"),
}


def spoilt(name, count, seed):
    seeds, reader, file = READERS[name]
    found = outcomes(seeds(), reader, file, count, seed)
    assert found["refused"] > count / 4 and found["read"] > 0 and found.total() == count


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.long) if n == "decks" else n for n in READERS])
def test_two_hundred_spoilt_files(name):
    spoilt(name, 100, 1)


@pytest.mark.long
@pytest.mark.parametrize("name", READERS)
def test_a_thousand_spoilt_files(name):
    spoilt(name, 1000, 2)


@pytest.mark.long
@pytest.mark.parametrize("name", READERS)
def test_twenty_thousand_spoilt_files(name):
    spoilt(name, 20_000, 3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no GRID"),
        ("\x00\xff" * 1000, "invalid card name"),
        ("GRID,1\n" * 3 + ",1" * 10_000, "it has .* fields; a GRID has at most 8"),
        ("RBE2,1,1,123,1,THRU,99999999\nGRID,1\nGRID,2,,1.,,\n", "no element"),
        ("CORD2R,1,2,,,,,,1.\n,1.\nCORD2R,2,1,,,,,,1.\n,1.\nGRID,1,1\n", "in a cycle"),
        (
            "".join(f"CORD2R,{k},{k + 1},,,,,,1.\n,1.\n" for k in range(1, 1000)) + "GRID,1,1\n",
            "no coordinate system",
        ),
        (
            "JUNK\n" * 20_000 + "GRID,1\n",
            "JUNK is not read: deck.bdf:1, .* and 19996",
        ),
        ("".join(f"GRID,{k},x,y,z\n" for k in range(1, 1000)), "there are more faults"),
        (
            "GRID,1\nGRID,2,,1.,,\nMPC,1,1,1,1.,2,1,-1.\nMPC,1,2,1,1.,1,1,-1.\nMAT1,1,1.,,.3\nPROD,1,1,1.\nCROD,1,1,1,2\n",
            "in a cycle",
        ),
    ],
)
def test_decks_made_to_hurt(text, words, tmp_path):
    path = tmp_path / "deck.bdf"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(ModelError, match=words) as error:
        read_nastran(path)
    assert len(str(error.value)) < 40_000


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("1 4 1 4", "1 99999999 1 4", "more than the file holds"),
        ("1 4 1 4", "1 -4 1 4", "more than the file holds"),
        ("4.1 0 8", "4.1 1 8", "save it as ASCII"),
        ("4.1 0 8", "9.7 0 8", "no mesh of Gmsh"),
        ("\n2 1 2 3 4\n", "\n2 1 2 3 9\n", "no mesh of Gmsh|not there"),
        ("\n4\n0 0 0", "\n123456789\n0 0 0", "too large for a tag"),
        ("$Nodes", "$NodeData\n999999999999\n$EndNodeData\n$Nodes", "save the mesh alone"),
    ],
)
def test_meshes_made_to_hurt(old, new, words, tmp_path):
    pytest.importorskip("meshio")
    path = tmp_path / "mesh.msh"
    path.write_text(MSH4.replace(old, new, 1))
    with pytest.raises(ModelError, match=words):
        read_mesh(path)


def test_other_files_with_meshes_are_refused(tmp_path):
    """Those that hold XML, or lead to other files."""
    for name in ("bomb.vtu", "mesh.xdmf", "mesh.inp"):
        (tmp_path / name).write_text("<xml/>")
        with pytest.raises(ModelError, match=r"those of Gmsh, \.msh, are read"):
            read_mesh(tmp_path / name)
    with pytest.raises(OSError):
        read_nastran(Path(tmp_path / "absent.bdf"))
