// dqwatch._core: what Python calls. Its shape is in _core.pyi, its words are in the modules around it.
#include <nanobind/nanobind.h>

#include "datagrams.hpp"
#include "dqw_version.h"
#include "jobs.hpp"
#include "lines.hpp"
#include "simulate.hpp"
#include "streams.hpp"

NB_MODULE(_core, m)
{
    m.attr("version") = DQW_VERSION;
    dqw::python::bind_jobs(m);
    dqw::python::bind_streams(m);
    dqw::python::bind_simulate(m);
    dqw::python::bind_lines(m);
    dqw::python::bind_datagrams(m);
}
