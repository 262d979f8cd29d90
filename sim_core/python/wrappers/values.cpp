// SPDX-License-Identifier: Apache-2.0
// What every part of a description offers in Python beside its values: changed copies, comparison, printing, pickling.
#include "conversions.hpp"

namespace sim_core::python {

using namespace nb::literals;

namespace {

/// The names of the readable values of a class, which are those of its constructor's arguments.
nb::list fields(nb::handle cls) {
    nb::list names;
    const nb::object property = nb::module_::import_("builtins").attr("property");
    for (nb::handle item : cls.attr("__dict__").attr("items")()) {
        if (nb::isinstance(item[1], property)) names.append(item[0]);
    }
    return names;
}

/// Arrays and lists as tuples, so that values compare, hash and print as one.
nb::object plain(nb::handle value) {
    if (nb::isinstance<nb::dict>(value)) {
        nb::dict items;
        for (auto [key, item] : nb::borrow<nb::dict>(value)) items[key] = plain(item);
        return items;
    }
    if (nb::hasattr(value, "tolist")) return plain(value.attr("tolist")());
    if (!nb::isinstance<nb::list>(value) && !nb::isinstance<nb::tuple>(value)) return nb::borrow(value);
    nb::list items;
    for (nb::handle item : value) items.append(plain(item));
    return nb::tuple(items);
}

nb::dict values(nb::handle self) {
    nb::dict all;
    for (nb::handle name : fields(self.type())) all[name] = plain(nb::getattr(self, name));
    return all;
}

void bind_value(nb::handle cls) {
    const auto define = [&](const char* name, auto function, const auto&... extra) {
        cls.attr(name) = nb::cpp_function(function, nb::name(name), nb::scope(cls), nb::is_method(), extra...);
    };
    const std::string type = nb::cast<std::string>(cls.attr("__name__"));
    define(
        "replace",
        [](nb::handle self, const nb::kwargs& changes) {
            nb::dict all = values(self);
            for (auto [name, value] : changes) {
                if (!all.contains(name)) {
                    const std::string known = nb::cast<std::string>(nb::str(", ").attr("join")(all.keys()));
                    throw InvalidInput(nb::cast<std::string>(self.type().attr("__name__")) + " has no '" +
                                       nb::cast<std::string>(name) + "', it has " + known);
                }
                all[name] = value;
            }
            return self.type()(**all);
        },
        "changes"_a, nb::sig(("def replace(self, **changes: object) -> " + type).c_str()),
        "A copy with other values.");
    define(
        "__eq__",
        [](nb::handle self, nb::handle other) -> nb::object {
            if (!self.type().is(other.type())) return nb::borrow(Py_NotImplemented);
            return nb::bool_(values(self).equal(values(other)));
        },
        "other"_a.none(), nb::sig("def __eq__(self, other: object, /) -> bool"));
    define(
        "__hash__",
        [](nb::handle self) {
            nb::list all;
            for (nb::handle value : values(self).values()) {
                const bool mapping = nb::isinstance<nb::dict>(value);
                all.append(mapping ? nb::tuple(nb::borrow<nb::dict>(value).items()) : nb::borrow(value));
            }
            return nb::hash(nb::tuple(all));
        },
        nb::sig("def __hash__(self) -> int"));
    define(
        "__repr__",
        [](nb::handle self) {
            std::string text = nb::cast<std::string>(self.type().attr("__name__")) + "(";
            const char* separator = "";
            for (auto [name, value] : values(self)) {
                text += separator + nb::cast<std::string>(name) + "=" + nb::cast<std::string>(nb::repr(value));
                separator = ", ";
            }
            return text + ")";
        },
        nb::sig("def __repr__(self) -> str"));
    define(
        "__reduce__",
        [](nb::handle self) {
            const nb::object partial = nb::module_::import_("functools").attr("partial");
            return nb::make_tuple(partial(self.type(), **values(self)), nb::tuple());
        },
        nb::sig("def __reduce__(self) -> tuple[object, ...]"));
}

}  // namespace

void bind_values(nb::module_& module) {
    for (const char* name :
         {"Current", "Sea", "Tank", "Contact", "Water", "LineProperties", "Fin", "Downwash", "HullTable", "Body",
          "MotionSum", "SteadyTow", "EmergencyStop", "Turn", "Sinusoid", "SliderCrank", "TimeSeries",
          "ResponseOperators", "ShipInSea", "SteadyPayout", "PayoutSeries"}) {
        bind_value(module.attr(name));
    }
    for (nb::handle integrator : module.attr("Integrator").attr("__subclasses__")()) bind_value(integrator);
    // Makes a class construct by the __init__ that it has now, which the library's own short cut passes by.
    module.def("_construct_by_init", [](nb::handle cls) {
        reinterpret_cast<PyTypeObject*>(cls.ptr())->tp_vectorcall = nullptr;
    }, "cls"_a);
}

}  // namespace sim_core::python
