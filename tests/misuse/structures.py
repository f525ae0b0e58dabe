"""Examples of structures, block matrices, networks of bodies, files and pictures."""

import jax.numpy as jnp
import numpy as np

from jaxmbs import fem, linear

from .attempts import call
from .cases import case

BLOCK = np.array([[[2.0, -1.0], [-1.0, 2.0]]] * 3)
NO_NUMBER = "an answer of names and structure has no number in it"


def of_structure(*more):
    return case(lambda z: call(z.structure, *more))


CASES = {
    "fem.Structure": case(
        lambda z: call(z.nodes, {"beams": (z.beam, [("a", "b"), ("b", "c")])}, {"a": "all"}),
        "elements name: names of groups are free",
    ),
    "fem.Group": case(lambda z: call(z.beam, ((0, 1),), True), "* *: made by Structure"),
    "fem.assemble": case(lambda z: call(z.structure, ["c"])),
    "fem.assemble_dense": of_structure(("stiffness", "mass")),
    "fem.assemble_blocks": of_structure(("stiffness", "mass")),
    "fem.element_matrices": of_structure("beams", "mass"),
    "fem.node_pattern": case(lambda z: call(z.structure), f"structure nan inside: {NO_NUMBER}"),
    "fem.body_load": of_structure(np.array([0.0, 0.0, -8.0])),
    "fem.geometric_stiffness": of_structure(np.ones(12)),
    "fem.buckling": of_structure(np.ones(12)),
    "fem.line_load": of_structure("beams", np.array([0.0, 0.0, -8.0])),
    "fem.pressure_load": case(lambda z: call(z.plate, "shell", 2.0)),
    "fem.nodal_load": case(
        lambda z: call(z.structure, {"c": {"z": -1.0}}), "structure nan inside: loads do not depend on its numbers"
    ),
    "fem.gather_rows": case(
        lambda z: call(z.structure, np.ones((3, 6))), "structure nan inside: places do not depend on its numbers"
    ),
    "fem.scatter_rows": case(
        lambda z: call(z.structure, np.ones(12)), "structure nan inside: places do not depend on its numbers"
    ),
    "fem.element_forces": of_structure(
        np.ones(12), {"beams": np.array([0.0, 0.0, -8.0])}, np.array([0.0, 0.0, -8.0])
    ),
    "fem.element_stresses": of_structure(np.ones(12), {"beams": np.array([0.0, 0.0, -8.0])}),
    "fem.recover_history": case(lambda z: call(fem.element_forces, z.structure, np.ones((2, 12)))),
    "blocksparse.Pattern": case(
        lambda z: call(4, 2, [(0, 1), (1, 2)], ["a", "b", "c", "d"], [2, 2, 2, 1]),
        "size huge: as large",
        "num_blocks huge: refused with other names",
        "names name: names are free",
        "names number for a name: names are free",
    ),
    "blocksparse.BlockMatrix": case(
        lambda z: call(z.pattern, np.ones((4, 1, 1)), np.ones((3, 1, 1)), np.ones((3, 1, 1))),
        "* nan: shows in whatever is asked",
        "* inf: likewise",
        "* complex: matrices may be",
        "* swapped: another kind of thing",
        "* text: likewise",
        "* none: likewise",
    ),
    "blocksparse.BlockOperator": case(lambda z: call(z.blocks[0]), "matrix nan inside: shows in whatever is asked"),
    "blocksparse.BlockSolver": case(lambda z: call("ldl"), through=lambda kind: _solved),
    "blocksparse.analyse": case(lambda z: call(z.pattern, None, None, np.ones((4, 3)), (3,)), "* *: of an order"),
    "blocksparse.assemble": case(lambda z: call(z.pattern, [[0, 1], [1, 2], [2, 3]], BLOCK[:, :, :, None, None])),
    "blocksparse.factor": case(lambda z: call(z.blocks[0], "ldl")),
    "blocksparse.matrix_inertia": case(lambda z: call(z.factor)),
    "blocksparse.is_finite": case(lambda z: call(z.factor), "factor nan inside: the answer is false"),
    "blocksparse.log_determinant": case(lambda z: call(z.factor)),
    "blocksparse.solve": case(lambda z: call(z.factor, np.ones((4, 1)))),
    "blocksparse.solve_once": case(lambda z: call(z.blocks[0], np.ones((4, 1)), "lu")),
    "statics.Bonds": case(
        lambda z: call(
            ["table"],
            {"left": ("ground", "table"), "right": ("ground", "table")},
            np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]),
            np.array([np.eye(3)] * 2),
            compliance=np.ones((2, 6)),
            length=2.0,
        ),
        "bonds name: names are free",
        through=lambda kind: kind.from_arrays,
        positive="compliance length",
    ),
    "statics.BodyNetwork": case(
        lambda z: call(["table"], {"left": ("ground", "table")}),
        "bonds name: names are free",
        through=lambda kind: kind.from_names,
    ),
    "statics.bond_reactions": case(lambda z: call(z.bonds, z.loads, "force")),
    "statics.reaction_family": case(
        lambda z: call(z.bonds, z.loads), "bonds nan inside: wrenches about the world origin need no places"
    ),
    "statics.reaction_matrix": case(lambda z: call(z.bonds)),
    "statics.redundancy": case(lambda z: call(z.bonds, "svd")),
    "statics.with_redundancy": case(lambda z: call(z.bonds)),
}


def _solved(kind):
    import lineax

    from jaxmbs import blocksparse

    K = linear.block_matrices(np.diag([2.0, 3.0]), size=1)[0]
    solver = blocksparse.BlockSolver(kind)
    return lineax.linear_solve(blocksparse.BlockOperator(K), jnp.ones((2, 1)), solver).value
