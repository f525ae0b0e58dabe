"""Places of all fields: a deck that pyNastran 1.4.1 wrote from numbers by name, as `add_crod(102, 20, [2, 3])`."""

import numpy as np
import pytest

import jaxmbs as mbs

DECK = """\
SPOINT        11      12
GRID           1              0.      0.      0.
GRID           2              1.      0.      0.
GRID           3              1.      1.      0.
GRID           4              0.      1.      0.
GRID           5              0.      0.      1.
GRID           6              1.      0.      1.
GRID           7              1.      1.      1.
GRID           8              0.      1.      1.
PROD          20       1  .00025                      .5
CROD         102      20       2       3
PELAS         21    111.
CELAS1       104      21       1       1       2       2
CELAS3       106      21      11      12
PDAMP         23     .75
CDAMP1       112      23       1       1       2       2
CDAMP3       114      23      11      12
PBUSH         25       K      1.      2.      3.      4.      5.      6.
                       B      .1      .2      .3      .4      .5      .6
CBUSH        116      25       1       3      0.      0.      1.
PBAR          26       1    .001 .000001 .000002 .000003    1.25
+
              .7      .8
CBAR         117      26       1       2      0.      1.      0.
               4      56     .01     .02     .03     .04     .05     .06
PBEAM         27       1    .001 .000001 .000002         .000003    1.25
+
              .7      .8
CBEAM        118      27       2       3      0.      0.      1.
               5       4     .01     .02     .03     .04     .05     .06
PBARL         28       1             BOX
              .1      .2     .01     .02      .5
CBAR         119      28       3       4      0.      0.      1.
PBEAML        29       1               I
              .2      .1      .1     .01    .012    .012      .5
CBEAM        120      29       4       1      0.      0.      1.
PSHELL        30       1     .01       1               1      .8     2.5
CQUAD4       121      30       1       2       3       4
CTRIA3       122      30       1       2       3
PSOLID        31       2
CHEXA        123      31       1       2       3       4       5       6
               7       8
CONROD       101       1       2       2  .00015                     .25
CELAS2       105    222.       1       3       2       4
CELAS4       107    333.      11      12
CDAMP2       113     .85       1       1       2       2
MAT1           1  2.1+11           .3125   7800.
MAT1           2   7.+10              .3   2700.
PMASS         22     4.5
CONM2        103       3             7.5      .1      .2      .3
              1.     .01      2.     .02     .03      3.
CMASS1       108      22       1       1       2       2
CMASS2       109     5.5       1       1       2       2
CMASS3       110      22      11      12
CMASS4       111     6.5      11      12
SPC1           6  123456       5
CORD2R         7              0.      0.      0.      0.      0.      1.
              1.      0.      1.
ENDDATA
"""


@pytest.fixture(scope="module")
def deck(tmp_path_factory):
    path = tmp_path_factory.mktemp("deck") / "by_others.bdf"
    path.write_text(DECK)
    return mbs.io.read_nastran(path)


PROPERTIES = {
    "CONROD 101": {"area": 1.5e-4, "line_mass": 0.25, "material": "MAT1 2"},
    "PROD 20": {"area": 2.5e-4, "line_mass": 0.5, "material": "MAT1 1"},
    "PELAS 21": {"stiffness": 111.0},
    "PMASS 22": {"mass": 4.5},
    "PDAMP 23": {"damping": 0.75},
    "PBUSH 25": {"stiffness": np.arange(1.0, 7.0), "damping": np.arange(1.0, 7.0) / 10},
    "PBAR 26": {
        **{"area": 1e-3, "inertia_1": 1e-6, "inertia_2": 2e-6, "torsion": 3e-6, "line_mass": 1.25},
        **{"shear": [0.7, 0.8], "material": "MAT1 1"},
    },
    "PBEAM 27": {
        **{"area": 1e-3, "inertia_1": 1e-6, "inertia_2": 2e-6, "torsion": 3e-6, "line_mass": 1.25},
        **{"shear": [0.7, 0.8], "material": "MAT1 1"},
    },
    "PBARL 28": {"area": 0.1 * 0.2 - 0.06 * 0.18, "line_mass": 0.5},
    "PBEAML 29": {"area": 0.176 * 0.01 + 0.2 * 0.012, "line_mass": 0.5},
    "PSHELL 30": {"thickness": 0.01, "area_mass": 2.5, "shear_factor": 0.8, "material": "MAT1 1"},
    "PSOLID 31": {"material": "MAT1 2"},
}
MATERIALS = {
    "MAT1 1": {"young": 2.1e11, "poisson": 0.3125, "density": 7800.0},
    "MAT1 2": {"young": 7e10, "poisson": 0.3, "density": 2700.0},
}
#: Nodes by their numbers, and what the card itself has.
ELEMENTS = {
    101: ((1, 2), {"property": "CONROD 101"}),
    102: ((2, 3), {"property": "PROD 20"}),
    103: ((3,), {"mass": [7.5], "offset": [[0.1, 0.2, 0.3]]}),
    104: ((1, 2), {"property": "PELAS 21", "ends": [[np.eye(6)[0], np.eye(6)[1]]]}),
    105: ((1, 2), {"rate": [222.0], "ends": [[np.eye(6)[2], np.eye(6)[3]]]}),
    106: ((11, 12), {"property": "PELAS 21"}),
    107: ((11, 12), {"rate": [333.0]}),
    108: ((1, 2), {"property": "PMASS 22", "ends": [[np.eye(6)[0], np.eye(6)[1]]]}),
    109: ((1, 2), {"rate": [5.5], "ends": [[np.eye(6)[0], np.eye(6)[1]]]}),
    110: ((11, 12), {"property": "PMASS 22"}),
    111: ((11, 12), {"rate": [6.5]}),
    112: ((1, 2), {"property": "PDAMP 23"}),
    113: ((1, 2), {"rate": [0.85]}),
    114: ((11, 12), {"property": "PDAMP 23"}),
    116: ((1, 3), {"property": "PBUSH 25", "vectors": [[0.0, 0.0, 1.0]]}),
    117: (
        (1, 2),
        {"vectors": [[0.0, 1.0, 0.0]], "offsets": [[[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]]]}
        | {"releases": ("rx1", "ry2", "rz2")},
    ),
    118: (
        (2, 3),
        {"vectors": [[0.0, 0.0, 1.0]], "offsets": [[[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]]]}
        | {"releases": ("ry1", "rx2")},
    ),
    119: ((3, 4), {"property": "PBARL 28"}),
    120: ((4, 1), {"property": "PBEAML 29"}),
    121: ((1, 2, 3, 4), {"property": "PSHELL 30"}),
    122: ((1, 2, 3), {"property": "PSHELL 30"}),
    123: ((1, 2, 3, 4, 5, 6, 7, 8), {"property": "PSOLID 31"}),
}


def check(made, wanted):
    for field, value in wanted.items():
        found = getattr(made, field)
        if isinstance(value, str | tuple):
            assert found == value
        else:
            np.testing.assert_allclose(found, value, rtol=1e-6)


@pytest.mark.parametrize("name", PROPERTIES)
def test_property(deck, name):
    check(deck.properties[name], PROPERTIES[name])


@pytest.mark.parametrize("name", MATERIALS)
def test_material(deck, name):
    check(deck.materials[name], MATERIALS[name])


@pytest.mark.parametrize("number", ELEMENTS)
def test_element(deck, number):
    nodes, wanted = ELEMENTS[number]
    groups = [getattr(group, "of", group) for group in deck.elements.values() if number in group.ids]
    made = groups[0]
    place = made.ids.index(number)
    assert tuple(deck.names[k] for k in made.nodes[place]) == tuple(
        f"{'SPOINT' if node > 10 else 'GRID'} {node}" for node in nodes
    )
    check(made, wanted)


def test_inertia_of_a_mass(deck):
    """About the centre of mass; products of inertia have the opposite sign of the matrix's entries."""
    made = next(group for group in deck.elements.values() if 103 in group.ids)
    np.testing.assert_allclose(made.inertia[0], [[1.0, -0.01, -0.02], [-0.01, 2.0, -0.03], [-0.02, -0.03, 3.0]])
