/* A real number that counts what is done with it, for the C code of this project. */

#ifndef COUNTED_H
#define COUNTED_H

#include <cmath>
#include <type_traits>

struct Counts {
    long additions = 0, multiplications = 0, divisions = 0, square_roots = 0, table_reads = 0;
};

static Counts counts;

/* A double that counts. The mark goes with every copy, so that a number of the table is known where
   it is used, whatever way it took; a result bears none. */
struct Counted {
    double value;
    bool of_table;
    Counted() = default;
    template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number>>>
    Counted(Number number) : value(static_cast<double>(number)), of_table(false)
    {
    }
    Counted operator-() const { return -used(); }
    Counted &operator+=(Counted other) { return *this = *this + other; }
    Counted &operator-=(Counted other) { return *this = *this - other; }
    Counted &operator*=(Counted other) { return *this = *this * other; }
    friend Counted operator+(Counted a, Counted b)
    {
        return counted(counts.additions, a.used() + b.used());
    }
    friend Counted operator-(Counted a, Counted b)
    {
        return counted(counts.additions, a.used() - b.used());
    }
    friend Counted operator*(Counted a, Counted b)
    {
        return counted(counts.multiplications, a.used() * b.used());
    }
    friend Counted operator/(Counted a, Counted b)
    {
        return counted(counts.divisions, a.used() / b.used());
    }
    friend bool operator<(Counted a, Counted b) { return a.value < b.value; }
    friend bool operator>(Counted a, Counted b) { return a.value > b.value; }
    friend bool operator<=(Counted a, Counted b) { return a.value <= b.value; }
    friend bool operator>=(Counted a, Counted b) { return a.value >= b.value; }
    friend bool operator==(Counted a, Counted b) { return a.value == b.value; }
    friend bool operator!=(Counted a, Counted b) { return a.value != b.value; }
    friend Counted root_of(Counted a)
    {
        return counted(counts.square_roots, std::sqrt(a.used()));
    }

  private:
    double used() const
    {
        counts.table_reads += of_table;
        return value;
    }
    static Counted counted(long &count, double result)
    {
        count++;
        return result;
    }
};

#define TQ_REAL Counted
#define TQ_LANES 1
#define TQ_SQRT(x) root_of(x)

#endif
