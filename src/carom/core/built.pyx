"""Digest of the sources from which the extension was built. All modules of the extension are built together."""

cdef extern from *:
    """
    #define carom_text(token) #token
    #define carom_text_of(macro) carom_text(macro)
    #define carom_SOURCES carom_text_of(CAROM_SOURCES)
    """
    const char* SOURCES "carom_SOURCES"

cdef extern from "float.h":
    int FLT_EVAL_METHOD

#: Result of `carom.core.extension.compute_sources_digest` at the time of the build.
DIGEST = SOURCES.decode("ascii")
#: 0 if every operation is rounded to the type of its operands, as IEEE 754 requires.
EVALUATION_METHOD = FLT_EVAL_METHOD


def less_product(double c, double a, double b):
    """Return ``c - a b``. The result shows whether the compiler fuses product and difference (with one rounding)."""
    return c - a * b
