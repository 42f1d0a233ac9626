"""Names a user may give: identifiers that C and C++ accept and that do not collide."""

import re

from signorini.codegen.frontend.errors import ModelError

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")

C_KEYWORDS = frozenset(
    """auto break case char const continue default do double else enum extern float for goto if
    inline int long register restrict return short signed sizeof static struct switch typedef
    union unsigned void volatile while _Bool _Complex _Imaginary""".split()
)
CPP_KEYWORDS = frozenset(
    """alignas alignof and and_eq asm bitand bitor bool catch char16_t char32_t class compl concept
    constexpr const_cast decltype delete dynamic_cast explicit export false friend mutable
    namespace new noexcept not not_eq nullptr operator or or_eq private protected public
    reinterpret_cast requires static_assert static_cast template this thread_local throw true
    try typeid typename using virtual wchar_t xor xor_eq""".split()
)
# Macros of the headers that the generated code or its user is likely to include.
C_MACROS = frozenset(
    """NULL EOF errno assert offsetof INFINITY NAN HUGE_VAL HUGE_VALF HUGE_VALL isnan isinf
    isfinite isnormal signbit fpclassify isgreater isless islessgreater isunordered
    math_errhandling FILENAME_MAX BUFSIZ RAND_MAX EXIT_SUCCESS EXIT_FAILURE stdin stdout stderr
    va_start va_end va_arg setjmp unix linux M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2
    M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2 M_SQRT1_2""".split()
)
# Macros of complex.h, of the Arduino core and of windows.h.
MACROS_ELSEWHERE = frozenset(
    """I complex imaginary PI HALF_PI TWO_PI DEG_TO_RAD RAD_TO_DEG EULER HIGH LOW INPUT OUTPUT
    INPUT_PULLUP SERIAL DISPLAY LSBFIRST MSBFIRST CHANGE FALLING RISING DEFAULT EXTERNAL INTERNAL
    F_CPU LED_BUILTIN constrain radians degrees sq bit lowByte highByte bitRead bitSet bitClear
    noInterrupts interrupts near far small min max IN OUT OPTIONAL TRUE FALSE ERROR CONST VOID
    CALLBACK WINAPI DELETE interface NEAR FAR""".split()
)
_MACRO_FAMILIES = re.compile(r"(DBL|FLT|LDBL|FP|MATH|SG|sg)_|SG\Z|_|B[01]{1,8}\Z")
# Headers of the C library: a file of that name beside the sources hides them.
HEADERS = frozenset(
    """assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal
    stdalign stdarg stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string tgmath threads
    time uchar wchar wctype features unistd pthread malloc alloca memory strings endian byteswap
    sched sys types""".split()
)
# Files of a generated folder that do not carry the prefix.
FILES = frozenset({"example", "Makefile", "README", "CMakeLists", "manifest"})
# libm functions the generated code may call: a quantity of that name would hide the function.
LIBM = frozenset(
    """sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp expm1 log log1p log10
    log2 sqrt cbrt pow fabs floor ceil fmod fmin fmax hypot copysign erf remainder fma round
    trunc frexp ldexp""".split()
)
LIBM_F = frozenset(name + "f" for name in LIBM)


def check_identifier(model: str, what: str, name: object, symbol: bool = True) -> str:
    """Return `name` if it is an identifier, and as a symbol one that C and C++ leave free.

    Names of contacts, constraints and outputs stand in C behind the model's prefix only
    (``symbol=False``), so a contact may be called ``floor``.
    """
    if not isinstance(name, str) or not _IDENTIFIER.match(name):
        raise ModelError(
            model,
            what,
            f"{name!r} is not an identifier",
            "Use a letter followed by letters, digits and underscores, ASCII only",
        )
    if len(name) > 63:
        raise ModelError(
            model, what, f"{name!r} has {len(name)} characters", "C99 guarantees 63: shorten it"
        )
    if not symbol:
        return name
    for taken, kind in (
        (C_KEYWORDS, "a keyword of C"),
        (CPP_KEYWORDS, "a keyword of C++"),
        (C_MACROS, "a macro of the C library"),
        (LIBM | LIBM_F, "a function of the C mathematics library"),
        (MACROS_ELSEWHERE, "a macro of complex.h, of the Arduino core or of windows.h"),
    ):
        if name in taken:
            raise ModelError(model, what, f"{name!r} is {kind}", "Choose another name")
    if _MACRO_FAMILIES.match(name):
        raise ModelError(
            model,
            what,
            f"{name!r} belongs to the C library's macros or to the generated code",
            "Choose another name",
        )
    if "__" in name:
        raise ModelError(
            model,
            what,
            f"{name!r} has a double underscore",
            "C++ reserves such names: choose another",
        )
    return name


def split_names(model: str, what: str, names: object) -> list[str]:
    """Split ``"x y phi"`` or ``"x, y, phi"`` or a sequence of names into a list."""
    if isinstance(names, str):
        return names.replace(",", " ").split()
    if isinstance(names, (list, tuple)) and all(isinstance(name, str) for name in names):
        return list(names)
    raise ModelError(model, what, f"got {names!r}", 'Give the names as one string, e.g. "x y phi"')
