"""Temperatures that vary over elements, against free motions of warm bodies and a published op2 file."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.elements._shell_section import strain_rotation
from jaxmbs.io.nastran._warming import _shell_forces, free_motions

STRIP = """BEGIN BULK
MAT1,1,2.+11,,.3,7850.,1.-5,20.
PSHELL,1,1,.01,1
PSOLID,2,1
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,.5,0.
GRID,4,,0.,.5,0.
{more}TEMP,5,1,20.,2,20.,3,80.
TEMP,5,4,80.
"""
QUAD = "CQUAD4,1,1,1,2,3,4{}\nSPC1,1,12345,1\nSPC1,1,1,4\n"
BRICK = "".join(
    f"GRID,{k + 4},,{x},{y},.2\n" for k, (x, y) in enumerate([(0, 0), (1, 0), (1, 0.5), (0, 0.5)], start=1)
)
BRICK += "CHEXA,1,2,1,2,3,4,5,6\n,7,8\nSPC1,1,12,1\nSPC1,1,1,4\nSPC1,1,3,1,2\nSPC1,1,3,4\n"
BRICK += "TEMP,5,5,20.,6,20.,7,80.\nTEMP,5,8,80.\n"


def read(folder, text):
    file = folder / "deck.bdf"
    file.write_text(text)
    return mbs.io.read_nastran(file)


@pytest.mark.slow
@pytest.mark.parametrize("more", [QUAD.format(""), QUAD.format(",,.05"), BRICK], ids=["CQUAD4", "ZOFFS", "CHEXA"])
def test_a_free_body_in_a_linear_temperature_bends(more, tmp_path):
    """Without stress: v = -alpha g x^2 / 2 where the temperature is 20 + g y."""
    u = read(tmp_path, STRIP.format(more=more)).statics("", "TEMPERATURE 5")
    np.testing.assert_allclose(u[1, 1], -1e-5 * 120.0 / 2, rtol=1e-9)
    np.testing.assert_allclose(u[2, 0], 1e-5 * 60.0, rtol=1e-9)


#: A quarter of msc/failure_indices_strength_ratio/TestStressTemp of pyNastran (BSD-3): nodes along one of its lines,
#: their temperatures, and displacements u, v that its op2 has for subcase 2.
X = [0.0, 0.02, 0.04000001, 0.06000001, 0.08000001, 0.1]
WARM = [20.0, 70.0, 100.0, 120.0, 150.0, 200.0]
EDGE = [(2.45725062e-7, -3.67442681e-7), (1.05537868e-6, -6.02136595e-7), (2.13472595e-6, -7.49447395e-7)]
EDGE += [(3.49433776e-6, -9.76962497e-7), (5.34134188e-6, -1.34742743e-6)]
PLIES = "".join(
    f",{mid},{t},{angle},,{mid},{t},{other}\n"
    for mid, t, angle, other in [(130, 3.1e-4, 0.0, 45.0), (130, 3.1e-4, 0.0, 0.0), (130, 3.1e-4, 45.0, 0.0)]
    + [(121, 0.01814, 0.0, 0.0)]
    + [(130, 3.1e-4, 0.0, 45.0), (130, 3.1e-4, 0.0, 0.0), (130, 3.1e-4, 45.0, 0.0)]
)
SANDWICH = (
    "BEGIN BULK\nPCOMP,2,-.02,5.95198,2.+7,TSAI,20.\n"
    + PLIES
    + "MAT8,121,1000.,1000.,.25,1000.,4.826+8,1.931+8,72.\n,2.3-5,2.3-5,20.\n"
    + "MAT8,130,7.632+10,7.632+10,.03,1.71+9,4.6+9,4.6+9,1608.\n,6.-7,6.-7,20.\n"
    + "".join(f"GRID,{1 + 6 * j + i},,{x},{0.0125 * j},0.\n" for j in range(3) for i, x in enumerate(X))
    + "".join(f"TEMP,4,{1 + 6 * j + i},{T}\n" for j in range(3) for i, T in enumerate(WARM))
    + "".join(
        f"CQUAD4,{k},2,{k + j},{k + j + 1},{k + j + 7},{k + j + 6}\n"
        for j in range(2)
        for k in range(5 * j + 1, 5 * j + 6)
    )
    + "SPC1,5,123456,1,7,13\nPARAM,AUTOSPC,NO\n"
)


@pytest.mark.slow
def test_a_sandwich_is_warmed_as_nastran_wrote_it(tmp_path):
    u = read(tmp_path, SANDWICH).statics("", "TEMPERATURE 4")
    np.testing.assert_allclose(u[1:6, :2], EDGE, rtol=2e-6)


LAMINATE = """BEGIN BULK
MAT8,8,140.+9,10.+9,.3,5.+9,4.+9,3.+9,1600.
,1.-6,3.-5,20.
PCOMP,1,.002
,8,.001,20.,,8,.003,-50.
GRID,1,,0.,0.,0.
GRID,2,,1.,.1,0.
GRID,3,,1.2,.9,0.
GRID,4,,-.1,.7,0.
CQUAD4,1,1,1,2,3,4,30.,.05
SPC1,1,123456,1
"""


@pytest.mark.slow
def test_uniform_forces_inside_are_those_of_the_free_motion(tmp_path):
    """Of an oblique element with coupling, an offset and an angle: its stiffness times what strains it so."""
    deck = read(tmp_path, LAMINATE)
    structure, warm = deck.structure, jnp.full(4, 120.0)
    (name,) = free_motions(deck, structure, warm)
    own, numbers, group = deck.elements[name].of, deck.numbers, structure.groups[name]
    motion = free_motions(deck, structure, warm)[name][0]
    element, nodes = jax.tree.map(lambda leaf: leaf[0], group.element), structure.positions[group.connections[0]]
    forces = _shell_forces(own, numbers.properties["PCOMP 1"], numbers.materials, warm[:1])[0]
    turn = strain_rotation(element.angle)
    inside = jnp.concatenate([turn.T @ forces[:3], turn.T @ forces[3:]])
    wanted = element.stiffness(nodes) @ motion.reshape(-1)
    found = element.initial_load(nodes, jnp.broadcast_to(inside, (4, 6)))
    np.testing.assert_allclose(found, wanted, rtol=1e-7, atol=1e-9 * np.max(np.abs(wanted)))
