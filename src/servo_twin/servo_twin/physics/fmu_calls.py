"""
A mechanism that somebody else compiled: its C functions, called from within a compiled kernel.

The functions of an FMU, and where its variables lie, stand in a row of integers in memory, the
table. The state of a servo holds the address of its table, so that a kernel that was compiled and
cached yesterday calls what is loaded today. Calls follow the C convention: FMI 2.0.4, sec. 2.1.7
and 4.2, FMI 3.0.1, sec. 2.2.6 and 4.2.
"""

from numba import carray, njit
from numba.core import cgutils, types
from numba.extending import intrinsic

ir = cgutils.ir

# the table, int64
VERSION, COMPONENT, STEP, SET, GET = 0, 1, 2, 3, 4  # 2 or 3; the rest are addresses
INPUTS, INPUT_REFERENCES, OUTPUTS, OUTPUT_REFERENCES = 5, 6, 7, 8  # counts and addresses
NUMBERS, SCRATCH, STATUS, SHAFTS = 9, 10, 11, 12
PLACES = 13  # where each of GIVEN stands among the outputs, or -1
GIVEN = ('motor_angle', 'motor_speed', 'load_angle', 'load_speed', 'torque')
TABLE_SIZE = PLACES + len(GIVEN)

# the numbers, float64
CLOCK, INPUT, INPUT_FACTOR, OUTPUT, OUTPUT_FACTOR = 0, 1, 3, 5, 10
NUMBERS_SIZE = 15

WORST_FAIR = 1  # the status of a warning; above, the call failed


def _pointer_to(kind):
    @intrinsic
    def pointer(typing_context, address):
        def code(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return types.CPointer(kind)(types.int64), code

    return pointer


_integers, _floats = _pointer_to(types.int64), _pointer_to(types.float64)


def _called(context, builder, arguments, kinds):
    """Call the C function whose address is the first argument; returns its status."""
    function = ir.FunctionType(ir.IntType(32), kinds)
    pointer = builder.inttoptr(arguments[0], function.as_pointer())
    return builder.call(pointer, arguments[1:])


_INTEGER, _FLAG, _FLOAT = ir.IntType(64), ir.IntType(32), ir.DoubleType()


@intrinsic
def _access2(typing_context, function, component, references, count, values):
    def code(context, builder, signature, arguments):
        return _called(context, builder, arguments, [_INTEGER] * 4)

    return types.int32(*[types.int64] * 5), code


@intrinsic
def _access3(typing_context, function, component, references, count, values, width):
    def code(context, builder, signature, arguments):
        return _called(context, builder, arguments, [_INTEGER] * 5)

    return types.int32(*[types.int64] * 6), code


@intrinsic
def _step2(typing_context, function, component, time, h, forget):
    def code(context, builder, signature, arguments):
        return _called(context, builder, arguments, [_INTEGER, _FLOAT, _FLOAT, _FLAG])

    return types.int32(types.int64, types.int64, types.float64, types.float64, types.int32), code


@intrinsic
def _step3(typing_context, function, component, time, h, forget, event, ends, early, last):
    def code(context, builder, signature, arguments):
        return _called(context, builder, arguments,
                       [_INTEGER, _FLOAT, _FLOAT, _FLAG, *[_INTEGER] * 4])

    return types.int32(types.int64, types.int64, types.float64, types.float64, types.int32,
                       *[types.int64] * 4), code


@njit(error_model='numpy')
def table_at(address):
    """Return the table at an address, int64, shape (TABLE_SIZE,)."""
    return carray(_integers(address), TABLE_SIZE)


@njit(error_model='numpy')
def numbers_of(table):
    """Return the numbers that belong to a table, float64, shape (NUMBERS_SIZE,)."""
    return carray(_floats(table[NUMBERS]), NUMBERS_SIZE)


@njit(error_model='numpy')
def exchange(table, numbers, h):
    """
    Give the inputs that stand in ``numbers``, step by ``h`` (s) and take the outputs.

    Returns whether all went well; the table's STATUS tells which call failed: ten times its number
    (1 set, 2 step, 3 get) plus its status.
    """
    values, version, component = table[NUMBERS], table[VERSION], table[COMPONENT]
    given = values + 8 * INPUT
    if version == 2:
        status = _access2(table[SET], component, table[INPUT_REFERENCES], table[INPUTS], given)
    else:
        status = _access3(table[SET], component, table[INPUT_REFERENCES], table[INPUTS], given,
                          table[INPUTS])
    if status > WORST_FAIR:
        table[STATUS] = 10 + status
        return False
    if version == 2:
        status = _step2(table[STEP], component, numbers[CLOCK], h, 1)
    else:
        room = table[SCRATCH]
        status = _step3(table[STEP], component, numbers[CLOCK], h, 1, room, room + 8, room + 16,
                        room + 24)
    if status > WORST_FAIR:
        table[STATUS] = 20 + status
        return False
    numbers[CLOCK] += h
    return take(table)


@njit(error_model='numpy')
def take(table):
    """Take the outputs as they stand; returns whether that went well."""
    taken, component = table[NUMBERS] + 8 * OUTPUT, table[COMPONENT]
    if table[VERSION] == 2:
        status = _access2(table[GET], component, table[OUTPUT_REFERENCES], table[OUTPUTS], taken)
    else:
        status = _access3(table[GET], component, table[OUTPUT_REFERENCES], table[OUTPUTS], taken,
                          table[OUTPUTS])
    if status > WORST_FAIR:
        table[STATUS] = 30 + status
        return False
    return True


@njit(error_model='numpy')
def output(table, numbers, which):
    """Return one of GIVEN by its place there, in the servo's units; NaN where it is not given."""
    place = table[PLACES + which]
    if place < 0:
        return float('nan')
    return numbers[OUTPUT + place] * numbers[OUTPUT_FACTOR + place]
