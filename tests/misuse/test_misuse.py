"""Every public function with wrong arguments of every kind: an error or a status, never a number.

The table of valid calls is in the modules beside this one.  A new public name fails here until it has an example, and
with that it is in the test.
"""

import importlib
import inspect

import pytest

import jaxmbs as mbs
from tests.test_public_faces import FACES

from . import components, load_questions, matrices, mechanisms, parts, structures, vehicles
from .attempts import Example, attempts, verdict
from .zoo import Zoo

TABLES = (mechanisms, parts, matrices, components, structures, load_questions, vehicles)
CASES = {name: case for table in TABLES for name, case in table.CASES.items()}
EXEMPT = {
    "answers, made by the library": """
        adapters.SystemBlock
        identification.Direction identification.Excitation identification.Identification experiment.ModelUpdate
        analysis.Equilibrium analysis.Linearisation analysis.Stiffness coupling.BaseMotion signal_flow.Instant
        coupling.BondLoad coupling.BondLoads coupling.CoupledResponse coupling.Determinacy
        coupling.MeasuredNetwork coupling.ModalPairs coupling.ComponentNetwork batching.Batch design.History
        design.Optimum reaction.JointReaction reaction.Reactions experiment.VirtualPoint fem.CoordinateTable
        studies.SobolShares design.Reliability design.InteriorPoint design.PolynomialChaos
        fem.Group flexible.FloatingFrame constraints.Kic constraints.SecondKic linear.Check
        cycles.HarmonicCycles engines.Flywheel engines.Orders cycles.Branch cycles.StabilityChange cycles.Cycle
        rotors.CriticalSpeeds rotors.Orbit rotors.Resonance rotors.RunUp rotors.UnbalanceResponse rotors.WhirlSpeeds
        rotors.BearingValidity
        vibration.HarmonicResponse vibration.LinearMotion vibration.LinearState vibration.ModalMotion vibration.Modes
        linear.StaticResponse model.System model.Topology motion.Diagnostics motion.LoadPeaks motion.Motion
        motion.Peak motion.Rates motion.EventRecord motion.PhaseState motion.VectorField reductions.Reduced
        statics.BondReaction statics.BondReactions
        statics.ReactionFamily statics.ReactionMatrix statics.Redundancy blocksparse.Factor blocksparse.Plan
        jaxmbs.Status experiment.SuspensionCheck vibration.ResonanceGains
        reductions.SymmetrySubspace reductions.VirtualMotions design.ParetoFront design.LimitResult design.Uncertainty
        design.Tolerance reaction.Actuation reaction.DriveLoad reaction.LawForce reaction.RowLoad
        studies.Designs io.Deck io.Imported io.JointLimits io.Mesh dynamics.ContactLoad dynamics.FrictionLoads
        dynamics.ElementReports dynamics.Validity analysis.ImpendingMotion dynamics.CableResult fem.Buckling
        flexible.GeometricStiffening
        flexible.StressEnvelope flexible.Stresses analysis.CampbellDiagram
        vehicles.Ride vehicles.Rig vehicles.RigCurves vehicles.PartLoads vehicles.LoadTable vehicles.Compliance
        vehicles.MountedParts vehicles.BrakeInTurn vehicles.SteerGain vehicles.StepResponse vehicles.SteadyTurn
        vehicles.Lane vehicles.FourPost vehicles.RoadMixDamage vehicles.RollCurves
        fatigue.Cycles fatigue.PsdTable qualification.CriticalPlane qualification.DamageSpectrum
        qualification.ResponseSpectrum qualification.ShockSpectrum qualification.StressSpectrum
        qualification.Envelope qualification.RandomResponse qualification.SineResponse
    """,
    "what users derive from": """
        forces.AbstractJointFriction
        hydraulics.AbstractHydraulicElement hydraulics.AbstractNode hydraulics.AbstractStorage
        hydraulics.AbstractTwoPort friction.AbstractBristles friction.AbstractFriction
        probability.AbstractDistribution
        elements.AbstractElement blocks.AbstractBlock forces.AbstractBodyLaw forces.AbstractLaw forces.AbstractPoseLaw

        forces.AbstractPathLaw forces.PathKinematics
        forces.ElementBond
        forces.InternalState forces.Margin forces.Reading forces.Arrows forces.PointLoads model.InternalStates
        contact.AbstractPair contact.Touch vehicles.AbstractRoad vehicles.AbstractTyreModel vehicles.SlipSlopes
        vehicles.Compression vehicles.ContactForces vehicles.Slip vehicles.CONVENTIONS vehicles.Convention
        vehicles.WEIGHTINGS vehicles.WeightingFilter vehicles.ForwardSpeed
        forces.AbstractScalarLaw forces.AbstractSignal forces.AbstractSystemLaw joints.AbstractClosure
        joints.AbstractRows joints.AbstractJoint joints.Node joints.parallel_rows reductions.AbstractReduction
        motion.Formulation
    """,
    "what is asked, judged with the question": """
        qualification.BaseForces qualification.BondForces qualification.Coordinates qualification.Recovery
        qualification.WhiteNoise vehicles.Arm vehicles.CarAxle vehicles.SuspensionRod vehicles.Strut
        vehicles.RoadShare vehicles.RoadRecord
    """,
    "no argument, a name, or a solver or event that simulate judges": """
        elements.DIRECTIONS motion.Event ode.ProjectedSolver ode.Gauss4 ode.ImplicitMidpoint ode.Rodas5P
        ode.SemiImplicitEuler builder.SystemBuilder
        jaxmbs.AssemblyError studies.StudyError jaxmbs.BatchError jaxmbs.ModelError jaxmbs.SimulationError
        design.SearchError jaxmbs.UnknownNameError jaxmbs.ModelFileError
    """,
    "files, programs and pictures, whose tests are their own": """
        io.read_dmig io.read_matrix_market io.read_op4 io.read_uff io.read_uff_modes io.write_uff io.read_urdf
        io.read_sdf io.read_mjcf io.Curves io.read_curves io.read_psd io.write_curves io.write_psd io.read_sid
        io.write_sid
        io.load_model io.save_model io.model_schema io.register io.read_mesh io.read_nastran viz.draw_bond_graph
        viz.plot_coordinates viz.plot_energy viz.plot_limit_values viz.plot_mechanism viz.plot_power
        viz.plot_element_power
        viz.plot_reactions viz.plot_history
        viz.plot_importances viz.Scene viz.Solid viz.ModeAnimation viz.animate viz.plot_bode
        viz.plot_branches viz.plot_campbell viz.plot_envelope viz.plot_pareto_front viz.plot_limits viz.plot_mac
        viz.plot_modes viz.plot_orbits
        viz.plot_nyquist viz.plot_parallel viz.plot_polar viz.plot_scatter viz.plot_structure viz.plot_views
        viz.plot_margins viz.plot_notches viz.plot_psd viz.plot_rainflow_matrix viz.plot_shock_spectrum viz.plot_sn
        viz.scene viz.animate_mode studies.sweep studies.open documents.report demo.run
        vehicles.read_tir vehicles.TirFile
        jaxmbs.cache jaxmbs.jit engines.flywheel fmi.Fmu fmi.export_fmu
    """,
}
# whose calls compile for more than a second
LONG = """
    adapters.as_block analysis.campbell analysis.equilibrium analysis.frequency_response analysis.impending_motion
    analysis.linearise analysis.modes analysis.stiffness assembly.states_along blocks.Delay blocks.FirstOrder
    blocks.Function blocks.LookUp blocks.PI blocks.PID blocks.RateLimit blocks.Saturation blocks.StateSpace
    blocks.TransferFunction blocksparse.assemble blocksparse.factor blocksparse.is_finite
    blocksparse.log_determinant blocksparse.matrix_inertia blocksparse.solve blocksparse.solve_once
    bondgraph.bond_powers bondgraph.element_powers bondgraph.graph_state_equations bondgraph.junction_residual
    constraints.internal_kic_second constraints.internal_kic_second_printed constraints.kic_rate
    constraints.kic_second constraints.kic_second_vector constraints.point_kic contact.ClosedCurve
    contact.CylinderOnPlane contact.HeightField contact.JournalInBush contact.RollerOnCurve
    contact.SphereInCylinder contact.SphereOnSphere contact.WheelOnRoad coupling.Components coupling.base_motion
    coupling.combine_modal_maxima coupling.couple_transfer coupling.coupled_response coupling.coupling_forces
    coupling.cqc_correlation coupling.limit_loads coupling.modal_pairs coupling.peak_response coupling.reactions
    coupling.regularised_inverse coupling.truncation_shortfall cycles.cycles_along
    cycles.harmonic_balance cycles.periodic
    rotors.critical_speeds
    rotors.critical_speed_map rotors.whirl_speeds rotors.unbalance_response rotors.resonance rotors.run_up
    design.Limit design.pareto dynamics.acceleration
    dynamics.angular_acceleration dynamics.cable_states dynamics.contact_load dynamics.element_reports
    dynamics.generalised_momentum dynamics.gyristor_field dynamics.gyristor_field_direct dynamics.hamiltonian
    dynamics.hamiltonian_slopes dynamics.joint_friction dynamics.spring_displacement dynamics.spring_kic_second
    dynamics.state_equations dynamics.validity elements.Beam elements.Quadrilateral elements.Triangle
    experiment.add_noise experiment.check_suspension experiment.coherence_variance experiment.decouple
    experiment.free_response experiment.measured_stiffness experiment.remove_stiffness experiment.rigid_channels
    experiment.sweep_amplitudes experiment.update experiment.virtual_point fatigue.damage fatigue.spectral_damage
    fem.body_load fem.buckling fem.element_forces fem.element_stresses fem.geometric_stiffness fem.line_load
    fem.pressure_load fem.recover_history flexible.ElasticBody flexible.carried_loads flexible.deformations
    flexible.displacements flexible.floating_frame flexible.interface_loads flexible.section_forces
    flexible.section_stresses flexible.stiffening flexible.stresses forces.BeamElement forces.BeamSection
    forces.BearingFriction forces.BevelGear forces.BristleForce forces.BrownMcPhee forces.Cable
    forces.FrictionForce forces.GearPair forces.InextensibleCable forces.JointLuGre forces.Sheave
    forces.SmoothCoulomb forces.Spline forces.Winch forces.WormGear forces.WrapCylinder forces.WrapSphere
    friction.BearingFriction friction.BrownMcPhee friction.LuGre friction.SmoothCoulomb hydraulics.Accumulator
    hydraulics.CheckValve hydraulics.Line hydraulics.Orifice hydraulics.Pump hydraulics.ReliefValve
    hydraulics.Tank hydraulics.Valve hydraulics.Volume identification.FourierMotion identification.best_excitation
    identification.from_log_cholesky identification.multiple_shooting jaxmbs.equilibrium jaxmbs.frequency_response
    jaxmbs.modes jaxmbs.random_response jaxmbs.reactions jaxmbs.signals jaxmbs.simulate joints.Distance
    joints.FramePath joints.KnifeEdge joints.RollingDisk linear.check linear.equilibrium linear.static_response
    motion.load_peaks motion.peak motion.simulate qualification.BaseAcceleration qualification.RandomForce
    qualification.critical_plane qualification.damage_spectrum qualification.random_response
    qualification.response_spectrum qualification.sine_response qualification.stress_spectrum
    qualification.von_mises_spectrum reaction.reaction_bonds reaction.reactions reductions.CraigChang
    reductions.MacNeal reductions.Mixed reductions.Rubin reductions.averaged_motion
    reductions.averaged_transformation reductions.force_errors reductions.mode_acceleration
    reductions.mode_acceleration_free reductions.transform_interface reductions.virtual_work signal_flow.signals
    statics.Bonds statics.bond_reactions vibration.complex_modes vibration.dense_response
    vibration.direct_response vibration.frequency_response vibration.harmonic_response vibration.lowest_modes
    vibration.modal_damping vibration.modal_motion vibration.modal_receptance vibration.modal_response
    vibration.modal_transfer_matrix vibration.modes vibration.natural_modes vibration.oscillations
    vibration.receptance vibration.resonance_gains vibration.simulate vibration.track_modes
    vibration.transfer_matrix vibration.transmissibility vibration.viscous_receptance
    vehicles.CleatRoad vehicles.SineRoad vehicles.SurfaceRoad vehicles.TandemCams vehicles.ride
    vehicles.load_cases vehicles.kc_rig vehicles.mount_suspension vehicles.mount_wheel vehicles.mount_solid_axle
    vehicles.mount_twist_beam vehicles.mount_anti_roll_bar vehicles.mount_steering vehicles.mount_differential
    vehicles.car vehicles.hardpoint_loads vehicles.PathFollower vehicles.BrakeTorque vehicles.CruiseControl
    vehicles.linearise_hardpoints vehicles.road_mix_damage vehicles.road_records_damage vehicles.four_post
    vehicles.post_heights vehicles.roll_curves
""".split()
WITHOUT = {name: reason for reason, names in EXEMPT.items() for name in names.split()}
INNER = {"jaxmbs.runtime"}  # a room for the library itself
ROOMS = sorted(set(FACES) - {"jaxmbs"} - INNER) + ["jaxmbs"]


def public():
    """Every public thing by "room.name", the first room of its own that lists it."""
    found = {}
    for room in ROOMS:
        module = importlib.import_module(room)
        for name in module.__all__:
            item = getattr(module, name)
            if not any(item is other for other in found.values()) and not hasattr(item, "__path__"):
                found[f"{room.rpartition('.')[2]}.{name}"] = item
    for module in (mbs.inertia, mbs.rotations):
        own = [f for _, f in inspect.getmembers(module, inspect.isfunction) if _is_own(f, module)]
        found |= {f"{module.__name__.rpartition('.')[2]}.{f.__name__}": f for f in own}
    return {name: item for name, item in found.items() if not inspect.ismodule(item)}


def _is_own(function, module):
    return function.__module__ == module.__name__ and not function.__name__.startswith("_")


PUBLIC = public()


def test_every_public_name_has_an_example():
    missing = sorted(set(PUBLIC) - set(CASES) - set(WITHOUT))
    assert not missing, f"give each an example of a valid call in the table of tests/misuse: {missing}"
    assert not sorted(set(CASES) - set(PUBLIC)), "examples of names that are gone"


@pytest.fixture(scope="session")
def zoo():
    return Zoo()


def _marked(name):
    return pytest.param(name, marks=pytest.mark.long if name in LONG else pytest.mark.slow)


@pytest.mark.parametrize("name", [_marked(name) for name in CASES])
def test_wrong_arguments_are_refused(name, zoo):
    case = CASES[name]
    function = PUBLIC[name] if case.through is None else case.through(PUBLIC[name])
    args, options = case.arguments(zoo)
    example = Example(function, args, options, case.fine, case.positive)
    function(*args, **options)  # the example is valid
    tried = list(attempts(example))
    wrong = {f"{attempt.argument}: {attempt.misuse}": verdict(attempt) for attempt in tried}
    print(f"\n{name}: {len(tried)} misuses")
    assert not {what: fault for what, fault in wrong.items() if fault}
