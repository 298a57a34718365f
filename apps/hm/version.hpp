#pragma once

/// The project's version and, where git knew one at build time, the commit: "0.1.0+1efc29a12345".
extern const char* const kVersion;
