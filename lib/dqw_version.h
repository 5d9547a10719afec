// The version: the one place that says it. Packages, the command and the build read it here.
#ifndef DQW_VERSION_H
#define DQW_VERSION_H

/// Major, minor, patch.
#define DQW_VERSION "0.2.0"

#endif
