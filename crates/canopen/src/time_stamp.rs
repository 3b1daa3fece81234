//! TIME (CiA 301, 7.2.6): the frame that carries the time of day.

use core::fmt;
use core::time::Duration;

use can::{CanId, Frame};

/// TIME_OF_DAY. Source: CiA 301, 7.1.6.5.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeOfDay {
    /// Milliseconds after midnight, 28 bits.
    pub millis: u32,
    /// Days since 1 January 1984.
    pub days: u16,
}

const MILLIS_MASK: u32 = 0x0FFF_FFFF;

/// Days from 1 January 1970, where Unix counts from, to 1 January 1984: 14 years, three of them leap years.
const UNIX_DAYS_TO_1984: u64 = 14 * 365 + 3;
const SECONDS_A_DAY: u64 = 24 * 3600;
const MILLIS_A_DAY: u128 = SECONDS_A_DAY as u128 * 1000;

impl TimeOfDay {
    /// Reads a frame of at least six bytes; `None` for a shorter one. The identifier is the caller's to check.
    pub fn parse(frame: &Frame) -> Option<Self> {
        let [a, b, c, d, e, f, ..] = frame.data() else { return None };
        let millis = u32::from_le_bytes([*a, *b, *c, *d]) & MILLIS_MASK;
        Some(Self { millis, days: u16::from_le_bytes([*e, *f]) })
    }

    /// The time of day at this time since 1 January 1970 (UTC), in whole milliseconds; `None` before 1984, and from 2163 on.
    pub fn from_unix(since_1970: Duration) -> Option<Self> {
        let (days, seconds) = (since_1970.as_secs() / SECONDS_A_DAY, since_1970.as_secs() % SECONDS_A_DAY);
        let days = u16::try_from(days.checked_sub(UNIX_DAYS_TO_1984)?).ok()?;
        Some(Self { millis: seconds as u32 * 1000 + since_1970.subsec_millis(), days })
    }

    /// The time of day so much later; in 2163 the days begin at 0 again.
    pub const fn after(self, time: Duration) -> Self {
        let millis = self.millis as u128 + time.as_millis();
        let days = (millis / MILLIS_A_DAY) as u64;
        Self { millis: (millis % MILLIS_A_DAY) as u32, days: self.days.wrapping_add(days as u16) }
    }

    /// Year, month and day of month.
    pub const fn date(self) -> (u16, u8, u8) {
        civil_date(UNIX_DAYS_TO_1984 + self.days as u64)
    }

    /// The frame on `id`. Milliseconds beyond 28 bits are dropped.
    pub fn emit(self, id: CanId) -> Frame {
        let [a, b, c, d] = (self.millis & MILLIS_MASK).to_le_bytes();
        let [e, f] = self.days.to_le_bytes();
        Frame::new(id, &[a, b, c, d, e, f])
    }
}

/// `2026-11-22 18:05:01.250`. Milliseconds beyond a day are shown as hours beyond 23.
impl fmt::Display for TimeOfDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = self.date();
        let (seconds, millis) = (self.millis / 1000, self.millis % 1000);
        let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
        write!(f, "{year}-{month:02}-{day:02} {hours:02}:{minutes:02}:{seconds:02}.{millis:03}")
    }
}

/// Year, month and day of month of a day counted from 1 January 1970, by the Gregorian calendar.
pub const fn civil_date(unix_day: u64) -> (u16, u8, u8) {
    /// Days of 400 years, which repeat.
    const ERA: u64 = 146_097;
    // Years are counted from March, so that the leap day is a year's last. 719468 days before 1970 is 1 March of the year 0.
    let day = unix_day + 719_468;
    let (era, of_era) = (day / ERA, day % ERA);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / (ERA - 1)) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * of_year + 2) / 153;
    let day_of_month = of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + era * 400 + if month <= 2 { 1 } else { 0 };
    (year as u16, month as u8, day_of_month as u8)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;
    use crate::connection_set;

    #[test]
    fn dates_are_those_of_the_calendar() {
        let date = |days| TimeOfDay { millis: 0, days }.date();
        assert_eq!((date(0), date(59), date(60), date(366)), ((1984, 1, 1), (1984, 2, 29), (1984, 3, 1), (1985, 1, 1)));
        // The Unix time 1000000000 was 2001-09-09 01:46:40 UTC; the calendar's day 0 was a Thursday, 1 January 1970.
        let billion = TimeOfDay::from_unix(Duration::new(1_000_000_000, 250_000_000)).unwrap();
        assert_eq!(billion.to_string(), "2001-09-09 01:46:40.250");
        assert_eq!((civil_date(0), civil_date(11_016)), ((1970, 1, 1), (2000, 2, 29)));
        assert_eq!(TimeOfDay::from_unix(Duration::from_secs(5113 * 86_400 - 1)), None);
        assert_eq!(TimeOfDay::from_unix(Duration::from_secs(5113 * 86_400)), Some(TimeOfDay { millis: 0, days: 0 }));
    }

    #[test]
    fn time_goes_on_over_midnight() {
        let evening = TimeOfDay { millis: 86_399_500, days: 58 };
        assert_eq!(evening.after(Duration::from_millis(499)), TimeOfDay { millis: 86_399_999, days: 58 });
        assert_eq!(evening.after(Duration::from_millis(500)), TimeOfDay { millis: 0, days: 59 });
        assert_eq!(evening.after(Duration::from_secs(3 * 86_400)), TimeOfDay { millis: 86_399_500, days: 61 });
        assert_eq!(TimeOfDay { millis: 0, days: u16::MAX }.after(Duration::from_secs(86_400)).days, 0);
    }

    #[test]
    fn what_is_emitted_is_parsed_back() {
        // Noon of 2 January 1984.
        let time = TimeOfDay { millis: 43_200_000, days: 1 };
        let frame = time.emit(connection_set::TIME);
        assert_eq!(frame, "100#002E93020100".parse().unwrap());
        assert_eq!(TimeOfDay::parse(&frame), Some(time));
        assert_eq!(TimeOfDay::parse(&"100#002E930201".parse().unwrap()), None);
    }
}
