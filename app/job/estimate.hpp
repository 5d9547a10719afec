// `learn` and `fit`: one log or several to one set of parameters.
#ifndef DQW_APP_JOB_ESTIMATE_HPP
#define DQW_APP_JOB_ESTIMATE_HPP

#include "app/job/options.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/learn.hpp"

namespace dqw {

/// What was estimated: effects beside parameters, where they were asked for.
struct Estimated {
    Result result;
    std::vector<TraceEffect> effects;
    std::string q15_config = {};  ///< a header, where the learners were those of port_q15/
};

/// By the learners in the arithmetic asked for, or by the reference fit; shows how far it is.
Estimated estimate_by_learners(const std::vector<Log>& logs, const Options& options, const LearnConfig& config);
Estimated estimate_by_fit(const std::vector<Log>& logs, const Options& options, const LearnConfig& config);

/// What `learn` and `fit` tell.
struct Estimation {
    Estimated estimated;
    Machine nominal;
    bool datasheet;  ///< told in a data sheet's numbers as well
};

/// Reads the logs and estimates; throws InputError.
Estimation learn_logs(const Options& options);
Estimation fit_logs(const Options& options);

/// The object of schema dqwatch.parameters/1; the same for people.
std::string estimation_json(const Estimation& estimation);
std::string estimation_text(const Estimation& estimation);

/// What the command line and a trace say to the learners.
LearnOptions learn_options(const Options& options, const LearnConfig& config, bool fixed_point);

}  // namespace dqw
#endif
