#include "app/monitor/store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "app/base/input_error.hpp"
#include "app/base/modulation.hpp"
#include "app/base/output.hpp"
#include "dqw_hash.h"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "dqwatch.store/1";
constexpr std::size_t kLargest = 65536;
constexpr const char* kExpected = "expected what dqwatch monitor --store wrote; remove it to begin anew";

struct Field {
    const char* name;
    std::optional<double> Machine::*value;
};
const Field fields[] = {
    {"pole_pairs", &Machine::pole_pairs},
    {"v_rated_V", &Machine::v_rated_V},
    {"i_rated_A", &Machine::i_rated_A},
    {"w_max_rad_s", &Machine::w_max_rad_s},
    {"R_ohm", &Machine::R_ohm},
    {"Ld_H", &Machine::Ld_H},
    {"Lq_H", &Machine::Lq_H},
    {"psi_Wb", &Machine::psi_Wb},
    {"J_kgm2", &Machine::J_kgm2},
};

std::string hex(const std::string& bytes)
{
    std::string text;
    for (const char c : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
    return text;
}

std::string unhex(const std::string& text)
{
    std::string bytes;
    for (std::size_t k = 0; k + 1 < text.size(); k += 2)
        bytes += static_cast<char>(std::stoi(text.substr(k, 2), nullptr, 16));
    return bytes;
}

std::string check_of(const std::string& text)
{
    return fmt::format("{:08x}", dqw_hash_bytes(dqw_hash_begin(), text.data(), text.size()));
}

Json body_of(const MonitorStore& s)
{
    Json machine = Json::object(), inputs = Json::array();
    for (const Field& f : fields)
        if (s.machine.*(f.value)) machine[f.name] = *(s.machine.*(f.value));
    for (const TraceInput& in : s.inputs)
        inputs.push_back({{"effect", in.effect},
                          {"shape", in.shape},
                          {"weights", in.weights},
                          {"reach", in.reach},
                          {"modulation", in.modulation},
                          {"map", in.map}});
    return {{"schema", kSchema},
            {"arithmetic", s.arithmetic},
            {"dt_s", s.dt_s},
            {"machine", machine},
            {"inputs", inputs},
            {"modulation", s.modulation},
            {"healthy", hex(s.healthy)},
            {"dead_time_width_A", s.dead_time_width_A},
            {"speed_lag_s", s.speed_lag_s},
            {"voltage_error_V", s.voltage_error_V}};
}

MonitorStore store_from(const Json& body)
{
    MonitorStore s;
    s.arithmetic = body.at("arithmetic").get<std::string>();
    s.dt_s = body.at("dt_s").get<double>();
    s.modulation = body.at("modulation").get<std::string>();
    s.healthy = unhex(body.at("healthy").get<std::string>());
    // Of an older one the usual width, a speed that is not late, and a voltage that is right.
    s.dead_time_width_A = body.value("dead_time_width_A", 0.0);
    s.speed_lag_s = body.value("speed_lag_s", 0.0);
    s.voltage_error_V = body.value("voltage_error_V", 0.0);
    for (const Field& f : fields)
        if (body.at("machine").contains(f.name)) s.machine.*(f.value) = body.at("machine").at(f.name).get<double>();
    for (const Json& in : body.at("inputs"))
        s.inputs.push_back({in.at("effect").get<std::string>(), in.at("shape").get<std::vector<double>>(),
                            in.at("weights").get<std::vector<double>>(), in.at("reach").get<double>(),
                            in.at("modulation").get<std::string>(), in.at("map").get<std::vector<std::int16_t>>()});
    return s;
}

std::string slurp(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    std::string text(kLargest + 1, '\0');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(in.gcount()));
    return text;
}

[[noreturn]] void fail(const std::string& path, const char* what)
{
    throw OutputError(fmt::format("{}: {}: {}", path, what, std::strerror(errno)));
}

/// The name points to the new file only once its bytes are on the disk.
void replace_file(const std::string& path, const std::string& text)
{
    const std::string fresh = path + ".new";
    const int fd = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (fd < 0) fail(fresh, "cannot be written");
    std::size_t done = 0;
    while (done < text.size()) {
        const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        done += static_cast<std::size_t>(n);
    }
    const bool whole = done == text.size() && ::fsync(fd) == 0;
    const int why = errno;
    const bool closed = ::close(fd) == 0;
    if (whole && closed && ::rename(fresh.c_str(), path.c_str()) == 0) return;
    if (!whole) errno = why;
    const int kept = errno;
    (void)::unlink(fresh.c_str());
    errno = kept;
    fail(path, "cannot be written");
}

}  // namespace

MonitorStore store_of(const MonitorSetup& setup, const std::string& arithmetic, const std::string& healthy)
{
    const dqw_estimator_config& c = setup.config.estimator;
    MonitorStore s;
    s.arithmetic = arithmetic;
    s.dt_s = static_cast<double>(c.dt_s);
    const auto put = [](std::optional<double>& to, float x) {
        if (x > 0.0F) to = static_cast<double>(x);
    };
    s.machine.pole_pairs = c.pole_pairs;
    put(s.machine.v_rated_V, c.v_base_V), put(s.machine.i_rated_A, c.i_base_A);
    put(s.machine.w_max_rad_s, c.w_base_rad_s);
    put(s.machine.R_ohm, c.R_ohm), put(s.machine.Ld_H, c.Ld_H), put(s.machine.Lq_H, c.Lq_H);
    put(s.machine.psi_Wb, c.psi_Wb), put(s.machine.J_kgm2, setup.config.J_kgm2);
    s.modulation = modulation_text(c.modulation);
    s.dead_time_width_A = static_cast<double>(c.dead_time_width_A), s.speed_lag_s = setup.speed_lag_s;
    s.voltage_error_V = static_cast<double>(c.voltage_error_V);
    s.inputs = setup.inputs;
    s.healthy = healthy;
    return s;
}

std::string store_text(const MonitorStore& store)
{
    Json body = body_of(store);
    body["check"] = check_of(body.dump());
    return body.dump() + "\n";
}

std::optional<MonitorStore> read_store(const std::string& path)
{
    struct stat info = {};
    if (::stat(path.c_str(), &info) != 0) {
        if (errno == ENOENT) return std::nullopt;
        throw InputError(path, 0, std::string("cannot be opened: ") + std::strerror(errno));
    }
    if (!S_ISREG(info.st_mode)) throw InputError(path, 0, std::string("is no file; ") + kExpected);
    const std::string text = slurp(path);
    if (text.size() > kLargest) throw InputError(path, 1, std::string("larger than 64 KiB; ") + kExpected);
    Json body = Json::parse(text, nullptr, false);
    if (!body.is_object() || body.value("schema", Json()) == Json() || !body["schema"].is_string())
        throw InputError(path, 1, std::string("no store of a monitor; ") + kExpected);
    if (body["schema"] != kSchema) throw InputError(path, 1, fmt::format("a store of another version; {}", kExpected));
    const Json check = body.value("check", Json());
    body.erase("check");
    if (check != check_of(body.dump())) throw InputError(path, 1, std::string("damaged; ") + kExpected);
    try {
        return store_from(body);
    } catch (const std::exception&) {
        throw InputError(path, 1, std::string("damaged; ") + kExpected);
    }
}

void write_store(const std::string& path, const MonitorStore& store) { replace_file(path, store_text(store)); }

void take_from_store(const MonitorStore& store, const std::string& path, const std::string& arithmetic, Log& log)
{
    if (store.arithmetic != arithmetic)
        throw InputError(path, 1,
                         fmt::format("written with --arith {}, now it is {}; {}", store.arithmetic, arithmetic,
                                     "expected the same, or another file"));
    constexpr double kSamePeriod = 0.01;
    if (!(std::fabs(log.dt_s - store.dt_s) <= kSamePeriod * store.dt_s))
        throw InputError(path, 1,
                         fmt::format("written with a row each {:.4g} s, now it is one each {:.4g} s; "
                                     "expected the same, or another file",
                                     store.dt_s, log.dt_s));
    log.dt_s = store.dt_s;
    log.voltage_error_V = std::max(log.voltage_error_V, store.voltage_error_V);
    for (const Field& f : fields) {
        std::optional<double>& said = log.machine.*(f.value);
        const std::optional<double>& was = store.machine.*(f.value);
        if (said && was && static_cast<float>(*said) != static_cast<float>(*was))
            throw InputError(path, 1,
                             fmt::format("written with {} {:.6g}, now {:.6g} is said; expected the same, or "
                                         "another file",
                                         f.name, *was, *said));
        if (!said) said = was;
    }
    if (log.modulation.empty() || log.modulation == "unknown") log.modulation = store.modulation;
}

void take_from_store(const MonitorStore& store, const std::string& path, MonitorSetup& setup)
{
    bool same = store.inputs.size() == setup.inputs.size();
    for (std::size_t k = 0; same && k < store.inputs.size(); ++k)
        same = store.inputs[k].effect == setup.inputs[k].effect;
    if (!same)
        throw InputError(path, 1,
                         "written with other effects; expected the same --effect and --config, or another file");
    setup.inputs = store.inputs;
}

}  // namespace dqw
