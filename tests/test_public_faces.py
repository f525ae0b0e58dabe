"""The public face of every room is this list: a name that comes or goes is a decision, not an accident."""

import importlib
import importlib.util
import inspect
import pkgutil
import pydoc

import pytest

import jaxmbs

FACES = {
    "jaxmbs.vibration": """
        CoordinateLaw HarmonicResponse LinearMotion LinearState ModalMotion ModalSuperposition Modes
        ResonanceGains accelerance acceleration_gain base_load complex_modes damped_frequency dense_response
        direct_response effective_masses frequency_response gain_from_mobility generalised_stiffness
        harmonic_response is_coupling_modes lowest_modes mac mobility mobility_from_gain modal_damping
        modal_motion modal_receptance modal_response modal_transfer_matrix mode_ratios modes natural_modes
        oscillations participation rayleigh_damping rayleigh_from_ratios receptance resonance_gains simulate
        structural_damping superpose track_modes transfer_matrix transmissibility viscous_receptance
    """,
    "jaxmbs.reaction": """
        Actuation DriveLoad JointReaction LawForce Reactions RowLoad inverse_dynamics reaction_bonds reactions
    """,
    "jaxmbs.batching": """
        Batch batch
    """,
    "jaxmbs.ode": """
        Gauss4 ImplicitMidpoint ProjectedSolver Rodas5P SemiImplicitEuler
    """,
    "jaxmbs.runtime": """
        FORWARD_MODE KnownFunction Packing Program SMALL_PROGRAM TracedFunction TrickState UnsupportedError
        any_in_batch as_argument as_array as_dtype as_host_array bytes_for_chunk bytes_of_arrays cache
        check_kind chunked_vmap compile_batch compile_kind constant_product content_of explain_error
        export expose fingerprint flag_advice follow_precision forget_with_programs fusion_barrier
        garbage_collection_paused gather_static host_call is_double is_motion is_on jaxpr_function jit
        kept_tiers kernel_options lapack lazy_where load_program map_chunked may_run_on_tapes
        missing_primitives
        not_tracing note ON_TAPE one_kernel progress_bar step_bar public_call release_advice remat
        report_compiles reverse_only save_factor segment_sum_static set_quick_flags sets_marks small_call
        store take_notes tracer_errors_in_words trick_states tuning user_jit with_library_calls
        warn_of_wrong_release without_tricks without_unused working_bytes
    """,
    "jaxmbs.documents": """
        report
    """,
    "jaxmbs.dynamics": """
        CableResult ContactLoad ElementReports FrictionLoads Validity acceleration angular_acceleration cable_states
        compliance_effort contact_load element_reports forward_dynamics generalised_momentum gravity_effort
        gyristor_field gyristor_field_direct hamiltonian hamiltonian_slopes independent_rates inertia_field
        joint_friction kinetic_energy mass_matrix
        potential_energy resistance_effort resistance_field
        source_effort spring_displacement spring_kic spring_kic_second spring_vector state_equations
        total_effort validity
    """,
    "jaxmbs.kinematics": """
        angular_velocity jacobian position rotation velocity
    """,
    "jaxmbs.constraints": """
        Kic SecondKic constraint_jacobian constraint_residual count_mobility internal_kic
        internal_kic_second internal_kic_second_printed kic kic_rate kic_second kic_second_vector
        left_product plane_mix point_kic quadratic right_product with_mobility_at
    """,
    "jaxmbs.signal_flow": """
        Instant signals
    """,
    "jaxmbs.assembly": """
        State branch states_along
    """,
    "jaxmbs.joints": """
        AbstractClosure AbstractJoint AbstractRows Coupler Cylindrical Distance FramePath Free KnifeEdge Node Planar
        PointOnLine PointOnPlane PositionRows Prismatic Revolute RollingDisk RollingSphere Screw Spherical Universal
        VelocityRows Weld parallel_rows
    """,
    "jaxmbs.blocks": """
        AbstractBlock Delay FirstOrder Function LookUp PI PID RateLimit Saturation StateSpace TransferFunction
    """,
    "jaxmbs.elements": """
        AbstractElement Beam DIRECTIONS GroundSpring Hexahedron Laminate LayeredQuadrilateral LayeredTriangle
        PointMass QuadraticHexahedron QuadraticQuadrilateral QuadraticTetrahedron QuadraticTriangle QuadraticWedge
        Quadrilateral Rod ShearPanel ShellSection Spring
        Tetrahedron Triangle Wedge hill_reserve orthotropic tsai_wu_reserve
    """,
    "jaxmbs": """
                Actuator AssemblyError BatchError BumpStop Bushing CoulombFriction Coupler Cylindrical Fmu Force
        Free Harmonic         Limit LinearSystem ModelError ModelFileError Motion PD Planar Pose Prismatic Ramp
        Revolute Screw         SimulationError Spherical Spline SpringDamper State Status Step System SystemBuilder
        Table Torque Universal         UnknownNameError Weld adapters analysis as_block assembly batch batching
        blocks blocksparse bondgraph cache check         constraints contact coupling cycles design documents dynamics
        elements engines
        equilibrium experiment export_fmu fatigue fem flexible forces         forward_dynamics frequency_response
        friction hydraulics identification identify inertia inverse_dynamics io         jit joints kinematics linear
        linearise load_model mass_matrix minimise model modes motion ode periodic position probability qualification
        random_response reaction reactions reductions report rotation rotations rotors runtime save_model
        shock_spectrum
        signal_flow signals simulate statics stiffness studies sweep vector_field vehicles velocity vibration viz
    """,
    "jaxmbs.adapters": """
        SystemBlock as_block fmi openmdao tesseract
    """,
    "jaxmbs.adapters.fmi": """
        Fmu export_fmu
    """,
    "jaxmbs.analysis": """
        CampbellDiagram Equilibrium ImpendingMotion Linearisation Stiffness campbell equilibrium
        frequency_response
        impending_motion linearise modes
        stiffness
    """,
    "jaxmbs.cycles": """
        Branch Cycle HarmonicCycles StabilityChange cycles_along harmonic_balance periodic
    """,
    "jaxmbs.engines": """
        CrankTrain CylinderPressure Flywheel Orders flywheel orders
    """,
    "jaxmbs.rotors": """
        Bearing BearingTable BearingValidity CriticalSpeeds Disk Orbit PlainBearing Resonance Rotor RunUp Shaft
        UnbalanceResponse WhirlSpeeds critical_speed_map critical_speeds resonance run_up separation_margin
        unbalance_response whirl_speeds
    """,
    "jaxmbs.blocksparse": """
        BlockMatrix BlockOperator BlockSolver Factor Pattern Plan analyse assemble factor is_finite
        log_determinant matrix_inertia solve solve_once
    """,
    "jaxmbs.bondgraph": """
        bond_graph bond_powers element_powers graph_state_equations junction_residual
    """,
    "jaxmbs.builder": """
        SystemBuilder
    """,
    "jaxmbs.contact": """
        AbstractPair BristleContact ClosedCurve Contact ContactLuGre CylinderOnPlane DryFriction HeightField
        HuntCrossley JournalInBush RollerOnCurve SphereInCylinder SphereOnPlane SphereOnSphere Touch WheelOnRoad
        hertz_stiffness
    """,
    "jaxmbs.vehicles": """
        AbstractRoad AbstractTyreModel Arm AxleTyres BrakeInTurn BrakeTorque BrushTyre CONVENTIONS
        CarAxle CleatRoad Compliance Compression ContactForces Convention CruiseControl FialaTyre
        FlatRoad ForwardSpeed FourPost Lane LaneChange LinearTyre LoadTable MagicFormula
        MountedParts ObstacleAvoidance PartLoads PathFollower RandomRoad Ride Rig RigCurves RoadMixDamage RoadRecord
        RoadShare RollCurves SineRoad SingleTrack Slip SlipSlopes SteadyTurn SteerGain StepResponse Strut
        SurfaceRoad Suspension SuspensionRod TandemCams TirFile Tyre WEIGHTINGS WeightingFilter
        brake_in_turn car double_wishbone five_link four_post hardpoint_loads kc_rig
        linearise_hardpoints load_cases mcpherson mount_anti_roll_bar mount_differential
        mount_solid_axle mount_steering mount_suspension mount_twist_beam mount_wheel post_heights
        read_tir ride road_mix_damage road_records_damage roll_curves sine_steer_response slopes_over
        step_steer_response trailing_arm weighting wheel_inputs
    """,
    "jaxmbs.coupling": """
        BaseMotion Bond BondLoad BondLoads ComponentNetwork Components CoupledResponse Determinacy
        MeasuredNetwork ModalPairs RigidBody base_motion bushing combine_modal_maxima connect couple_transfer
        coupled_response coupling_forces cqc_correlation equivalent_impulse hinge interface_pattern
        limit_loads modal_pairs peak_response reactions regularised_inverse rigid_bond truncation_shortfall
        uncoupled_transfer
    """,
    "jaxmbs.demo": """
        run
    """,
    "jaxmbs.design": """
        History InteriorPoint Limit LimitResult Optimum ParetoFront PolynomialChaos Reliability Robust SearchError
        Tolerance Uncertainty Worst interior_point interior_point_batch minimise moments pareto percentile
        polynomial_chaos propagate_uncertainty reliability sensitivities tolerances
    """,
    "jaxmbs.experiment": """
        MeasuredModes ModelUpdate SuspensionCheck VirtualPoint add_noise check_suspension coherence_variance
        decouple flexible_channels free_response mean_of_repeats measured_stiffness noise_variance nonlinearity
        propagate propagate_scalar remove_stiffness rigid_channels sweep_amplitudes sweep_phase sweep_variance
        update virtual_point
    """,
    "jaxmbs.identification": """
        Direction Excitation FourierMotion Identification best_excitation from_log_cholesky identify log_cholesky
        multiple_shooting
    """,
    "jaxmbs.probability": """
        AbstractDistribution Beta Empirical Gumbel LogNormal Normal RandomVariables Triangular Uniform Weibull
    """,
    "jaxmbs.fatigue": """
        Cycles PsdTable SN SpectralMoments damage equivalent_load psd_table rainflow spectral_damage
    """,
    "jaxmbs.fem": """
        Buckling CoordinateTable Group Structure assemble assemble_blocks assemble_dense body_load buckling
        element_forces element_matrices element_stresses gather_rows geometric_stiffness line_load
        nodal_load node_pattern pressure_load
        recover_history scatter_rows
    """,
    "jaxmbs.flexible": """
        ElasticBody FloatingFrame GeometricStiffening StressEnvelope Stresses carried_loads deformations
        displacements floating_frame interface_loads mass_properties section_forces section_stresses stiffening
        stresses
    """,
    "jaxmbs.forces": """
        AbstractBodyLaw AbstractLaw AbstractPathLaw AbstractPoseLaw AbstractScalarLaw AbstractSignal
        AbstractSystemLaw AbstractJointFriction Actuator AirSpring Arrows Attachment BeamElement BeamSection
        BearingFriction BevelGear BristleForce BrownMcPhee BumpStop Bushing Cable CamRise Chirp Constant
        CoulombFriction ElastoPlastic ElementBond Eyelet Force FrictionForce GearPair GeneralisedEffort
        Harmonic HydraulicCylinder InextensibleCable InternalState JointLuGre LuGre Margin Maxwell Motor
        Multisine PD PathForce PathKinematics PointLoads Polynomial PolynomialSpring Prony PronyBushing Ramp Reading
        Sheave SmoothCoulomb Spline SpringDamper Step Table Torque Trapezoid Winch WormGear WrapCylinder WrapSphere
        Wrench Zener
    """,
    "jaxmbs.friction": """
        AbstractBristles AbstractFriction BearingFriction BrownMcPhee LuGre SmoothCoulomb
    """,
    "jaxmbs.hydraulics": """
        AbstractHydraulicElement AbstractNode AbstractStorage AbstractTwoPort Accumulator CheckValve Line Orifice Pump
        ReliefValve Tank Valve Volume
    """,
    "jaxmbs.io": """
        Curves Deck Imported JointLimits Mesh load_model model_schema read_curves read_dmig read_matrix_market
        read_mesh read_mjcf read_nastran read_op4 read_psd read_sdf read_sid read_uff read_uff_modes read_urdf
        register save_model write_curves write_psd write_sid write_uff
    """,
    "jaxmbs.linear": """
        Check LinearSystem StaticResponse TransferFunctions block_matrices check constraint_modes equilibrium
        interface_basis partition rigid_motions static_response
    """,
    "jaxmbs.model": """
        InternalStates Pose System Topology
    """,
    "jaxmbs.motion": """
        Diagnostics Event EventRecord Formulation LoadPeaks Motion Peak PhaseState
        Rates VectorField load_peaks peak simulate vector_field
    """,
    "jaxmbs.reductions": """
        AbstractReduction Characteristic CraigBampton CraigChang Cyclic Guyan Hurty MacNeal Mirror Mixed
        Reduced Rubin SymmetrySubspace Unreduced VirtualMotions averaged_motion averaged_transformation
        characteristic_modes determinate_coordinates element_loads fixed_interface_modes force_errors
        frequency_errors harmonic_amplitudes interface_forces mode_acceleration mode_acceleration_free
        num_modes_below reduce rigid_body_motions rigid_node rigid_transformation rotate support_motions
        transform_interface virtual_work
    """,
    "jaxmbs.statics": """
        BodyNetwork BondReaction BondReactions Bonds ReactionFamily ReactionMatrix Redundancy bond_reactions
        reaction_family reaction_matrix redundancy with_redundancy
    """,
    "jaxmbs.qualification": """
        BaseAcceleration BaseForces BondForces Coordinates CriticalPlane DamageSpectrum Envelope LoadCase
        RandomForce RandomResponse Recovery ResponseSpectrum ShockSpectrum SineResponse StressSpectrum WhiteNoise
        critical_plane damage_spectrum load_envelope miles random_response random_spectrum
        response_spectrum shock_spectrum sine_response stress_spectrum von_mises_spectrum
    """,
    "jaxmbs.studies": """
        Designs SobolShares StudyError grid latin_hypercube normal open pareto_front sobol sobol_shares sweep
    """,
    "jaxmbs.viz": """
        ModeAnimation Scene Solid animate animate_mode draw_bond_graph plot_bode plot_branches
        plot_campbell
        plot_coordinates plot_element_power plot_energy plot_envelope plot_history plot_importances
        plot_limit_values plot_limits
        plot_mac plot_margins plot_mechanism plot_modes plot_notches plot_nyquist plot_orbits plot_parallel
        plot_pareto_front plot_polar plot_power plot_psd plot_rainflow_matrix plot_reactions plot_scatter
        plot_shock_spectrum plot_sn plot_structure plot_views scene
    """,
}


@pytest.mark.parametrize("room", FACES)
def test_face(room):
    module = importlib.import_module(room)
    assert sorted(module.__all__) == sorted(FACES[room].split())
    assert all(hasattr(module, name) for name in module.__all__)


def test_top_level_holds_the_first_week():
    """Every room is an attribute; beside the rooms there are about sixty names, and never more than 75."""
    inner = {
        "arguments",
        "builder",
        "cli",
        "demo",
        "doctor",
        "math",
        "verbs",
    }  # names at the top, or no one's
    rooms = {module.name for module in pkgutil.iter_modules(jaxmbs.__path__) if module.ispkg} - inner
    assert all(inspect.ismodule(getattr(jaxmbs, room)) for room in rooms)
    assert rooms <= set(jaxmbs.__all__) and list(jaxmbs.__all__) == sorted(jaxmbs.__all__)
    assert len(set(jaxmbs.__all__) - rooms) <= 75


def test_no_name_stands_over_a_module():
    """Where a function has the name of its module, `import jaxmbs.linear.check` gives the function."""
    names = [(importlib.import_module(room), name) for room in FACES for name in FACES[room].split()]
    functions = [f"{room.__name__}.{name}" for room, name in names if not inspect.ismodule(getattr(room, name))]
    assert not [path for path in functions if importlib.util.find_spec(path)]


@pytest.mark.parametrize("room", ["jaxmbs", "jaxmbs.viz", "jaxmbs.linear"])
def test_help_lists_its_functions(room):
    text = pydoc.plain(pydoc.render_doc(importlib.import_module(room)))
    functions = [name for name in FACES[room].split() if callable(getattr(importlib.import_module(room), name))]
    assert all(name in text for name in functions)


def test_every_public_thing_has_one_room():
    """But for those that `jaxmbs` itself shows, a thing is reached by one path; nothing hands on what another has."""
    owners = {}
    for room in set(FACES) - {"jaxmbs"}:
        module = importlib.import_module(room)
        for name in module.__all__:
            item = getattr(module, name)
            if not inspect.ismodule(item) and (inspect.isclass(item) or callable(item)):
                owners.setdefault(id(item), set()).add(f"{room}.{name}")
    assert not [places for places in owners.values() if len(places) > 1]
