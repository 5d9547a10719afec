// `columns`: what was made of a log, column by column.
#ifndef DQW_APP_JOB_COLUMNS_HPP
#define DQW_APP_JOB_COLUMNS_HPP

#include <string>
#include <vector>

#include "app/job/options.hpp"
#include "app/read/survey.hpp"
#include "ref/log/log.hpp"

namespace dqw {

struct Surveyed {
    std::string path;
    Log log;
    Survey survey;
    std::vector<std::string> notes;
};

/// Reads the log, whatever it lacks; throws InputError.
Surveyed survey_log(const Options& options);

/// The object of schema dqwatch.columns/1; the same for people.
std::string survey_json(const Surveyed& surveyed);
std::string survey_text(const Surveyed& surveyed);

}  // namespace dqw
#endif
