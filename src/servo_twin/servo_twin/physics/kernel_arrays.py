"""Arrays within a kernel: views that cost nothing to make, and copies known to the compiler."""

from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array


@intrinsic
def borrowed(typing_context, array):
    """
    Return the same array without a share in its ownership.

    Slicing an array counts an owner more, atomically, and letting the slice go counts one less:
    more than many a law costs. A slice of a borrowed array counts nothing. Only for use while the
    caller holds the array; numba's arrays of any shape.
    """

    def code(context, builder, signature, arguments):
        view = context.make_array(signature.args[0])(context, builder, arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), code


@intrinsic(prefer_literal=True)
def own(typing_context, array, size):
    """
    Return a copy of an array of ``size`` numbers or switches, a constant, on the stack.

    The compiler takes out of loops what it knows to be nobody else's, and loops over what it knows
    the length of. Only for use within the caller; refuses an array that is not contiguous.
    """
    if array.layout != 'C':
        raise TypingError(f'own: {array} is not contiguous')
    size = size.literal_value

    def code(context, builder, signature, arguments):
        kind = signature.args[0]
        element = context.get_data_type(kind.dtype)
        count, width = (context.get_constant(types.intp, n)
                        for n in (size, context.get_abi_sizeof(element)))
        given = context.make_array(kind)(context, builder, arguments[0])
        room = cgutils.alloca_once(builder, element, size=size)
        cgutils.raw_memcpy(builder, room, given.data, count, width)
        view = context.make_array(kind)(context, builder)
        populate_array(view, room, [count], [width], width, None)
        return view._getvalue()

    return array(array, types.literal(size)), code
