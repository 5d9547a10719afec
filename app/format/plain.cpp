// dqwatch's own format: columns in SI under their own names.
#include "app/format/formats.hpp"

namespace dqw {
namespace {

void describe(Import& in)
{
    for (const ColumnInfo& column : columns)
        for (std::size_t f = 0; f < in.head.fields.size(); ++f)
            if (in.head.fields[f] == column.name) {
                in.take(column.id, f, unit_names(column.id).front());
                break;
            }
    in.gaps = false;
}

}  // namespace

const Format plain = {"dqwatch", "dqwatch's own: columns in SI units under their names", {}, nullptr, describe};

}  // namespace dqw
