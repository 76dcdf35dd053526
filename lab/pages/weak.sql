-- Which categories are weakest: fail, or draw most warnings?
SELECT category, count(*) AS assets, count(*) FILTER (status = 'failed') AS failed, round(avg(warnings), 1) AS warnings,
    round(quantile_cont(seconds_total, 0.5), 1) AS "s, median"
FROM assets GROUP BY category HAVING count(*) > 1 ORDER BY failed / count(*) DESC, warnings DESC, category LIMIT 5
