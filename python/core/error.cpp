#include "error.hpp"

#include <algorithm>
#include <new>
#include <stdexcept>

#include "app/base/input_error.hpp"
#include "app/job/options.hpp"

namespace nb = nanobind;

namespace dqw::python {
namespace {

/// Bytes of a file's name may be no UTF-8.
nb::object text(const std::string& bytes)
{
    return nb::steal(PyUnicode_DecodeUTF8(bytes.data(), static_cast<Py_ssize_t>(bytes.size()), "replace"));
}

[[noreturn]] void raise(const char* name, const nb::object& error)
{
    PyErr_SetObject(nb::module_::import_("dqwatch._errors").attr(name).ptr(), error.ptr());
    throw nb::python_error();
}

[[noreturn]] void raise_plain(const char* name, const std::string& what)
{
    raise(name, nb::module_::import_("dqwatch._errors").attr(name)(text(what)));
}

[[noreturn]] void raise_input(const InputError& error, const std::vector<std::string>& tables)
{
    std::string what = error.what();
    const std::string before = error.file + ":" + std::to_string(error.line) + ": ";
    if (what.compare(0, before.size(), before) == 0) what.erase(0, before.size());
    const bool table = std::find(tables.begin(), tables.end(), error.file) != tables.end();
    raise("InputError",
          nb::module_::import_("dqwatch._errors").attr("input_error")(text(error.file), error.line, text(what), table));
}

}  // namespace

void raise_current(const std::vector<std::string>& tables)
{
    try {
        throw;
    } catch (const nb::python_error&) {
        throw;
    } catch (const InputError& error) {
        raise_input(error, tables);
    } catch (const UsageError& error) {
        raise_plain("UsageError", error.what());
    } catch (const ValueError& error) {
        raise_plain("UsageError", error.what());
    } catch (const std::invalid_argument& error) {
        raise_plain("UsageError", error.what());
    } catch (const std::bad_alloc&) {
        PyErr_NoMemory();
        throw nb::python_error();
    } catch (const std::exception& error) {
        raise_plain("Error", error.what());
    } catch (...) {
        raise_plain("Error", "unknown failure");
    }
}

void raise_usage(const std::string& what) { raise_plain("UsageError", what); }

}  // namespace dqw::python
