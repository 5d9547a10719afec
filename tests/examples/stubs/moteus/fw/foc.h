// What examples/moteus takes from moteus' fw/foc.h.
#pragma once

namespace moteus {

struct SinCos {
    float s;
    float c;
};

}  // namespace moteus
