"""What the extension was built from. Its modules are built together or not at all: this one stands for them."""

cdef extern from *:
    """
    #define carom_text(token) #token
    #define carom_text_of(macro) carom_text(macro)
    #define carom_SOURCES carom_text_of(CAROM_SOURCES)
    """
    const char* SOURCES "carom_SOURCES"

cdef extern from "float.h":
    int FLT_EVAL_METHOD

#: `carom.core.extension.compute_sources_digest` at the time of the build.
DIGEST = SOURCES.decode("ascii")
#: 0 where every operation is rounded to its own type, as IEEE 754 demands.
EVALUATION_METHOD = FLT_EVAL_METHOD


def less_product(double c, double a, double b):
    """Return ``c - a b``, whose bits tell whether the compiler has made one operation of the two, and rounds once."""
    return c - a * b
