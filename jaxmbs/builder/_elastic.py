"""Elastic bodies as declared: a massless body at each interface, moving on its own joint, and a run of modes."""

from dataclasses import dataclass

from ..joints import Free
from ..joints._base import AbstractJoint
from ..joints._modal import Modal
from ..model._elastic import ElasticBody, ElasticGroup
from ._declarations import GROUND, Body, Joint

MODES = "modes"


@dataclass
class ElasticDeclaration:
    """An elastic body as declared; `motions`: joints by interface that restrict its motion on the first one."""

    name: str
    body: ElasticBody
    motions: dict

    @property
    def interfaces(self) -> tuple[str, ...]:
        """Names of the bodies at its interfaces."""
        return tuple(f"{self.name}.{interface}" for interface in self.body.interfaces)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints of its other interfaces and of its modes."""
        return self.interfaces[1:] + ((f"{self.name}.{MODES}",) if self.body.num_modes else ())

    def parts(self, pose):
        """Declarations of its bodies, one at each interface, and of their joints."""
        first, *others = self.interfaces
        bodies, joints = [_massless_body(first, pose)], []
        for name, short, place in zip(others, self.body.interfaces[1:], self.body.places, strict=True):
            bodies.append(_massless_body(name))
            kind = self.motions.get(short, Free())
            joints.append(Joint(name, kind, first, name, place, None, None, is_elastic=True))
        if self.body.num_modes:
            name = f"{self.name}.{MODES}"
            bodies.append(_massless_body(name))
            joints.append(Joint(name, Modal(self.body.num_modes), first, name, None, None, None, is_elastic=True))
        return bodies, joints


def _massless_body(name, pose=None):
    return Body(name, 0.0, (0.0, 0.0, 0.0), 0.0, pose)


def elastic_faults(name, body, motions) -> list[str]:
    """Faults of the declaration of an elastic body."""
    where = f"elastic body {name!r}"
    if not isinstance(body, ElasticBody):
        return [f"{where}: it must be an ElasticBody (see jaxmbs.flexible.floating_frame), got {type(body).__name__}"]
    others = body.interfaces[1:]
    found = [f"{where}: {fault}" for fault in body.faults()]
    found += [f"{where}: motions of {m!r}: its other interfaces are {others}" for m in motions if m not in others]
    found += [
        f"{where}: the motion of {m!r} must be a joint such as Planar('z'), got {kind!r}"
        for m, kind in motions.items()
        if not isinstance(kind, AbstractJoint)
    ]
    return found


def entry_faults(elastic, joints) -> list[str]:
    """Faults of elastic bodies that the ground reaches first at another interface than their first."""
    inside = {body: item for item in elastic.values() for body in item.interfaces}
    neighbours: dict = {}
    for joint in joints:
        neighbours.setdefault(joint.parent, []).append(joint.child)
        neighbours.setdefault(joint.child, []).append(joint.parent)
    reached, queue, found = {GROUND}, [GROUND], []
    for body in queue:
        for other in neighbours.get(body, []):
            if other in reached:
                continue
            reached.add(other)
            queue.append(other)
            item = inside.get(other)
            if item is None:
                continue
            first, *others = item.interfaces
            if other != first and first not in reached:
                found.append(
                    f"elastic body {item.name!r}: the ground reaches it at {other.removeprefix(item.name + '.')!r}; "
                    "name that interface first, or cut the joint there: build(cut=[...])"
                )
            reached.update(item.interfaces)
            queue.extend(b for b in item.interfaces if b != other)
    return found


def elastic_items(elastic, index, record):
    """(name, body, frames, (columns, coordinates), key) of every elastic body, for grouping by shape."""
    for item in elastic.values():
        modes = record.get(f"{item.name}.{MODES}")
        spans = (slice(0, 0),) * 2 if modes is None else (modes.velocities, modes.coordinates)
        numbers = tuple(tuple(range(s.start, s.stop)) for s in spans)
        frames = tuple(index[body] + 1 for body in item.interfaces)  # frame 0 is the ground's
        yield item.name, item.body, frames, numbers, "elastic"


def elastic_groups(grouped) -> tuple[ElasticGroup, ...]:
    """Elastic bodies of equal shape, stacked."""
    return tuple(
        ElasticGroup(names, frames, tuple(c for c, _ in numbers), tuple(q for _, q in numbers), body)
        for _, names, body, frames, numbers, _ in grouped
    )
