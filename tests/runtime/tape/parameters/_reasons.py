"""Parameters that take one value in all cases, and the primitives that no function of this release of JAX binds."""

_OF_DEVICES = "where numbers lie: programs of more than one device are not on tapes"
_TYPE = "the type of the result, which tapes read from the result itself"
_SHAPE = "the shape of the result, which tapes read from the result itself"
_PROMISE = "a promise that lets a compiler do less; tapes do without"
_KINDS = "how the compiler does it, with the same answer"
_INNER = "programs and their numbers of arguments, which a case cannot change alone"

#: Why a parameter, of all or of one primitive, cannot change an answer, or is not read; "*" is every primitive.
REASONS = {
    ("*", "sharding"): _OF_DEVICES,
    ("*", "out_sharding"): _OF_DEVICES,
    ("*", "accuracy"): "how far a compiler may be off",
    ("*", "dtype"): _TYPE,
    ("*", "new_dtype"): _TYPE,
    ("*", "index_dtype"): _TYPE,
    ("*", "weak_type"): "how the type of the result takes part in promotion, a matter of tracing",
    ("*", "input_dtype"): _TYPE,
    ("*", "shape"): _SHAPE,
    ("*", "new_sizes"): _SHAPE,
    ("*", "indices_are_sorted"): _PROMISE,
    ("*", "unique_indices"): _PROMISE,
    ("*", "algorithm"): _KINDS,
    ("*", "implementation"): _KINDS,
    ("*", "use_magma"): _KINDS,
    ("*", "update_jaxpr"): "that of the primitive's name; that of `apply` is refused",
    ("*", "update_consts"): "constants of `update_jaxpr`, of which there are none",
    ("*", "subset_by_index"): "refused by JAX on CPU; by the rules too",
    ("*", "donated_invars"): _KINDS,
    ("*", "inline"): _KINDS,
    ("broadcast_in_dim", "sharding"): _OF_DEVICES,
    ("cond", "branches"): _INNER,
    ("conj", "input_dtype"): _TYPE,
    ("device_put", "copy_semantics"): _OF_DEVICES,
    ("device_put", "devices"): _OF_DEVICES,
    ("device_put", "srcs"): _OF_DEVICES,
    ("dot_general", "precision"): "doubles have one; other algorithms than the default are refused",
    ("eig", "enable_eigvec_derivs"): "of derivatives, which are made before",
    ("eigh", "sort_eigenvalues"): "LAPACK sorts them",
    ("name", "name"): "numbers are what they are; that of `SHOWN` is kept for who looks",
    ("nontraceable", "name"): "of messages",
    ("platform_index", "platforms"): _INNER,
    ("scan", "_split_transpose"): _KINDS,
    ("scan", "linear"): "of derivatives, which are made before",
    ("scan", "unroll"): _KINDS,
    ("schur", "select_callable"): "asked for with an order alone, which is refused",
    ("schur", "sort_eig_vals"): "refused by the rule where it is set",
    ("sort", "is_stable"): "tapes keep the order of equal keys, and others may",
    ("triangular_solve", "conjugate_a"): "of complex matrices, see the cases",
}
#: Primitives with a rule that no function of this release of JAX binds, or that another test binds.
ELSEWHERE = {
    **dict.fromkeys(("copy_p", "empty2", "expand_dims", "log2", "stop_gradient"), "of other releases of JAX"),
    **{f"scatter_{name}": "of other releases of JAX" for name in ("add", "sub", "mul", "min", "max")},
    **dict.fromkeys(
        ("nonbatchable", "nondifferentiable_backward", "reverse_only"), "the same numbers, a mark of tracing"
    ),
    **dict.fromkeys(("pvary", "xla_metadata_value"), "the same numbers, for several devices or for the compiler"),
    "tape_host": "of the rules for complex numbers, whose cases bind it",
}
