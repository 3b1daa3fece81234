//! Calendar times of logs. They carry no time zone, so that both ways are UTC.

use can::Instant;
use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::fmt::strtime;
use jiff::tz::TimeZone;

/// Vector's forms of a date behind the name of the day.
const FORMS: [&str; 4] =
    ["%b %d %I:%M:%S%.f %p %Y", "%b %d %I:%M:%S %p %Y", "%b %d %H:%M:%S%.f %Y", "%b %d %H:%M:%S %Y"];

/// Month names of a German Windows that differ from the English.
const GERMAN_MONTHS: [(&str, &str); 4] = [("Mär", "Mar"), ("Mai", "May"), ("Okt", "Oct"), ("Dez", "Dec")];

/// Days from the zero of an automation date (1899-12-30) to that of Unix time.
const AUTOMATION_DATE_OF_UNIX_ZERO: f64 = 25_569.0;

const NANOS_OF_A_DAY: f64 = 86_400e9;

/// `Sat Sep 30 15:06:13.191 2017` or `Sat Sep 30 03:06:13.191 pm 2017` as Unix time.
pub(super) fn parse_date(text: &str) -> Option<Instant> {
    let (_day, date) = text.trim().split_once(char::is_whitespace)?;
    let mut date = date.trim().to_owned();
    for (german, english) in GERMAN_MONTHS {
        date = date.replacen(german, english, 1);
    }
    let parsed = FORMS.iter().find_map(|form| strtime::parse(form, &date).ok()?.to_datetime().ok());
    unix_time(parsed?)
}

/// Unix time as `Sat Sep 30 15:06:13.191 2017`, cut to milliseconds.
pub(super) fn print_date(at: Instant) -> String {
    strtime::format("%a %b %d %H:%M:%S.%3f %Y", civil(at)).unwrap_or_default()
}

/// Days since 1899-12-30, as PEAK's traces and spreadsheets count, as Unix time.
pub(super) fn of_automation_date(days: f64) -> Option<Instant> {
    let nanos = (days - AUTOMATION_DATE_OF_UNIX_ZERO) * NANOS_OF_A_DAY;
    // The text has ten decimals at best, some 10 µs: what is below a microsecond is noise.
    (nanos >= 0.0 && nanos < u64::MAX as f64).then(|| Instant::from_micros((nanos / 1e3).round() as u64))
}

/// The eight numbers of a SYSTEMTIME (Windows) as Unix time: year, month, day of the week, day, hour, minute, second,
/// millisecond.
pub(super) fn of_system_time(fields: [u16; 8]) -> Option<Instant> {
    let [year, month, _, day, hour, minute, second, milli] = fields;
    let small = |field: u16| i8::try_from(field).ok();
    let nanos = i32::from(milli).checked_mul(1_000_000)?;
    let date = DateTime::new(
        i16::try_from(year).ok()?,
        small(month)?,
        small(day)?,
        small(hour)?,
        small(minute)?,
        small(second)?,
        nanos,
    );
    unix_time(date.ok()?)
}

/// Unix time as the eight numbers of a SYSTEMTIME, cut to milliseconds.
pub(super) fn to_system_time(at: Instant) -> [u16; 8] {
    let date = civil(at);
    let day_of_week = date.weekday().to_sunday_zero_offset();
    let fields = [date.month(), day_of_week, date.day(), date.hour(), date.minute(), date.second()].map(i16::from);
    let [month, weekday, day, hour, minute, second] = fields;
    [date.year(), month, weekday, day, hour, minute, second, date.millisecond()].map(|field| field as u16)
}

fn civil(at: Instant) -> DateTime {
    let timestamp = Timestamp::from_nanosecond(i128::from(at.as_nanos())).unwrap_or_default();
    TimeZone::UTC.to_datetime(timestamp)
}

fn unix_time(date: DateTime) -> Option<Instant> {
    let nanos = TimeZone::UTC.to_timestamp(date).ok()?.as_nanosecond();
    u64::try_from(nanos).ok().map(Instant::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `date -u -d '2017-09-30 15:06:13.191' +%s.%N`
    const SEPTEMBER: Instant = Instant::from_millis(1_506_783_973_191);

    #[test]
    fn dates_of_vector_are_read_in_all_their_forms() {
        for text in [
            "Sat Sep 30 15:06:13.191 2017",
            "Sat Sep 30 03:06:13.191 PM 2017",
            "Sat Sep 30 03:06:13.191 pm 2017",
            "Sam Sep 30 15:06:13.191 2017",
        ] {
            assert_eq!(parse_date(text), Some(SEPTEMBER), "{text}");
        }
        assert_eq!(parse_date("Son Dez 31 23:59:59 2023"), Some(Instant::from_secs(1_704_067_199)));
        for text in ["", "Sat", "Sat Sep 31 15:06:13 2017", "Sat Foo 30 15:06:13 2017", "Sat Sep 30 15:06:13 1901"] {
            assert_eq!(parse_date(text), None, "{text}");
        }
        assert_eq!(print_date(SEPTEMBER), "Sat Sep 30 15:06:13.191 2017");
    }

    #[test]
    fn a_system_time_is_read_as_it_is_written() {
        let fields = [2017, 9, 6, 30, 15, 6, 13, 191];
        assert_eq!(to_system_time(SEPTEMBER), fields);
        assert_eq!(of_system_time(fields), Some(SEPTEMBER));
        assert_eq!(of_system_time([0; 8]), None);
        assert_eq!(of_system_time([u16::MAX; 8]), None);
    }

    #[test]
    fn an_automation_date_counts_days_since_1899() {
        // 0.5364870833 of a day are 46352.484 s, that is 12:52:32.484; day 37704 is 2003-03-24.
        let at = of_automation_date(37_704.536_487_083_3).unwrap();
        let expected = parse_date("Mon Mar 24 12:52:32.484 2003").unwrap();
        assert!(at.as_nanos().abs_diff(expected.as_nanos()) < 1_000_000, "{at:?}");
        for days in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e12] {
            assert_eq!(of_automation_date(days), None);
        }
    }
}
