"""Views of arrays that cost nothing to make."""

from numba.core import cgutils
from numba.extending import intrinsic


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
