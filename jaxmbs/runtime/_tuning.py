"""Tuned numbers: sizes at which the library changes its algorithm or its program for speed alone.

Each says what it decides, and in brackets the script of `benchmarks/` whose figures move with it.  All were set on
two cores of an x86-64 server CPU.  Answers agree to rounding on both sides of every number: nothing but speed and
memory changes with it.
"""

# ----------------------------------------------------------------------------------------- gathers and sums of rows
#: States or loads that `map_chunked` works on side by side: with 64 designs their numbers stay in the cache
#: (`saved_times.py`: 101 saved states three times cheaper than all at once).
ROWS_TOGETHER = 8
#: Runs of neighbouring rows that `gather_static` takes by slices, whose transpose is no loop (`cold_start.py`).
SLICED_RUNS = 6
#: Entries of the 0-1 matrix by which `gather_static` takes a few scattered rows (`cold_start.py`).
GATHER_PRODUCT = 64
#: Entries of the 0-1 matrix by which `segment_sum_static`, and sums along the bonds of statics, add rows
#: (`cold_start.py`, `networks.py`).
SUM_PRODUCT = 4096
#: Nodes of a tree whose sums are products with the matrix of paths in place of a loop (`tree_dynamics.py`,
#: `closed_loop.py`); the loop's work is linear in the nodes.
TREE_SUM_PRODUCT = 12

# ------------------------------------------------------------------------------------------- programs of the compiler
#: Numbers of a matrix factor that a gradient saves in place of computing it again (`trajectory_gradient.py`).
SAVED_FACTOR = 2048
#: Numbers of an argument whose cotangent the adjoint of a motion packs into one vector with others.  Packing spares
#: operations on many small arrays and copies large ones: packed, the gradient of a structure of 60 coordinates takes
#: 2.4 times as long (a linear transient of 400 steps; mechanisms have small arguments only).
PACKED_COTANGENT = 1024
#: Multiplications of a batched product that is expanded to a sum (`batch_of_motions.py`: a tenth at 128 to 512).
EXPANDED_PRODUCT = 512
#: Entries of a matrix whose products are left to XLA's library, on several threads: a loop with one of them is not
#: made one kernel (`trajectory_gradient.py`).
LIBRARY_PRODUCT = 4096

#: Doubles of the arena of a tape, beyond which a program is compiled: large arrays run through memory once for every
#: operation of a tape (`first_answers.py`).
TAPE_DOUBLES = 10_000_000
#: Multiplications of one instruction, some 30 ms, beyond which a program is compiled: the machine has no library of
#: kernels (`first_answers.py`).
TAPE_WORK = 32_000_000
#: What XLA takes to compile any program, and for each instruction of its tape [CPU s] (`cold_start.py`).
COMPILE_START, COMPILE_SECONDS = 0.3, 5e-3
#: Numbers of a constant that is computed while a tape is written (`first_answers.py`).
FOLDED_CONSTANT = 4096
#: Doubles of an arena that is kept between calls of a tape; a larger one is made anew each time (`first_answers.py`).
TAPE_ARENA_KEPT = 200_000
#: Numbers of the question and answer that are stored with a tape, for a first test of it elsewhere (`cold_start.py`).
PROBE_NUMBERS = 100_000
#: Bytes of a program beyond which it is not stored: reading it would take as long as tracing it (`cold_start.py`).
STORED_BYTES = 64 * 2**20
#: Numbers of an operand, and instructions, up to which a single operation runs on a tape: more are worth compiling
#: (`first_answers.py`).
EAGER_NUMBERS, EAGER_INSTRUCTIONS = 100_000, 400
#: Calls of a public function after which its single operations are compiled: each call costs some milliseconds more
#: on tapes, all programs together some seconds (`first_answers.py`).
EAGER_CALLS = 300
#: Tapes that a function keeps, for as many shapes and static arguments; the oldest go (`first_answers.py`).
TAPES_KEPT = 256

# ----------------------------------------------------------------------------------------------- dense linear algebra
#: Columns of a positive definite matrix that are eliminated one by one; larger matrices go by blocks of `SPD_BLOCK`
#: (`reactions.py`): a rank-one update of a large matrix is bound by memory, a block's update is a product.
SPD_COLUMNS, SPD_BLOCK = 48, 16
#: Unknowns of a general matrix that is inverted by Gauss-Jordan elimination, not by LAPACK (`substructures.py`).
ELIMINATED_UNKNOWNS = 32
#: Multiplications of a product of a matrix and few columns that is a sum in one loop: a call takes twice as long
#: (`closed_loop.py`).
FEW_COLUMNS = 10_000
#: Unknowns and rows of a saddle system whose inverse is formed: six products of a round are two (`closed_loop.py`).
WHOLE_SADDLE = 16
#: Velocities of a mechanism with loops from which on its saddle systems are solved node by node with a front, or by
#: the multifrontal factor, not as dense matrices (`closed_loop.py`).
FRONTAL_VELOCITIES, MULTIFRONTAL_VELOCITIES = 24, 250
#: Rows from which a front pays, and velocities from which it does so with any number of rows: a step of a car of 35
#: velocities and 21 rows takes four times as long with a front, one of 20 four-bars (41, 100) half as long.
FRONTAL_ROWS, MANY_VELOCITIES = 48, 96
#: Slots of a front, and rows that read any column, up to which that is done node by node (`closed_loop.py`).
FRONT_WIDTH, BORDER_ROWS = 8, 8
#: Bonds of a network of components and its coordinates from which on its matrices are stored in blocks and solved by
#: the multifrontal factor (`component_chain.py`).  Runs break even at 12 bonds and 216 coordinates; blocks take some
#: seconds more to compile.
NETWORK_BONDS, NETWORK_ROWS = 24, 240
#: Rows shared by indeterminate joints that are solved for in one dense system (`reactions.py`).
SHARED_ROWS = 120
#: Loops of a network up to which `method="auto"` solves for their parameters at once (`networks.py`).
NETWORK_LOOPS = 20
#: Loop parameters (6 a loop), and bonds times loops, up to which one dense singular value decomposition finds what is
#: indeterminate (`networks.py`).
SVD_PARAMETERS, SVD_ENTRIES = 600, 100_000
#: Pivots of a front of the block-sparse solver that are kept as the inverse of their factor (`networks.py`).
INVERTED_PIVOTS = 64
#: Pivots of a front that are eliminated column by column (`networks.py`).
FRONT_COLUMNS = 24
#: Fronts assembled into one (`networks.py`: more of them give more shapes of fronts, which is more to compile).
FRONT_CHILDREN = 4
#: Work [flops] of a front that does not grow with its size, and of a step of a scan over fronts (`networks.py`).
FRONT_OVERHEAD, STEP_OVERHEAD = 4e3, 2e4
#: Numbers in the fronts of one step of that scan: about what a core's cache holds (`networks.py`).
STEP_ENTRIES = 60_000
#: Shapes of fronts of one height among which the padding is chosen (the choice takes time quadratic in it).
FRONT_SHAPES = 24

#: Rows of outputs in a spectrum from which on they are recovered by real products in place of complex ones, which of
#: few rows are part of the loop around them (`qualification.py`: 1 000 designs with one row twice as fast).
RECOVERED_ROWS = 16

# ---------------------------------------------------------------------------------------------------- many designs
#: Designs that run on tapes, one after another on each core; more are worth the compiler (`first_answers.py`).
TAPE_DESIGNS = 100
#: Functions whose batched programs are kept: those asked last.  They hold their functions, none would go by itself.
BATCHED_FUNCTIONS = 32
#: Designs of a batch in one chunk on a CPU: as cheap each as 64, cheaper than 16 or 128 (`batch_of_motions.py`).
CHUNK = 32
#: Chunks of one call where a function has no loop of its own: a call takes 0.5 ms beside its work (`accelerator.py`).
CHUNKS_IN_TURN = 32
#: Designs of a chunk on an accelerator (`accelerator.py`).
DEVICE_CHUNK = 2**15
#: Bytes of all arrays that a chunk makes, above which it has fewer designs, and the fewest: what is in use is to stay
#: in the cache (`closed_loop.py`: a row of 160 four-bars, 8 designs in 1.0 ms each, 32 in 1.6).
CACHED_CHUNK, SMALL_CHUNK = 128 * 2**20, 8
#: Bytes that the intermediate and returned arrays of one chunk may take (`batch_of_motions.py`: loads of wishbones).
CHUNK_BYTES = 256 * 2**20
#: Chunks for each thread before designs are first grouped by what they cost (`batch_of_motions.py`).
FIRST_CHUNKS = 4
#: Searches of a multistart side by side: few, since they end one after the other (`wishbone_limits.py`).
SEARCHES_TOGETHER = 8

#: Largest number of directions that a component of another program derives together, though it is asked for one at a
#: time (`openmdao_component.py`).
JACOBIAN_DIRECTIONS = 32
#: Seconds after which a motion shows a bar that was not asked for, and those after which it says what takes so long,
#: if all of it would take longer than the last of these.
SECONDS_TO_BAR, SECONDS_TO_ADVICE, SLOW_SECONDS = 3.0, 5.0, 60.0
