"""What the extension was built from. Its modules are built together or not at all: this one stands for them."""

cdef extern from *:
    """
    #define carom_text(token) #token
    #define carom_text_of(macro) carom_text(macro)
    #define carom_SOURCES carom_text_of(CAROM_SOURCES)
    """
    const char* SOURCES "carom_SOURCES"

#: `carom.extension.sources_digest` at the time of the build.
DIGEST = SOURCES.decode("ascii")
